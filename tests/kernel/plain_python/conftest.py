"""Tests of parts of the kernel one by one, as plain Python: compiled code has no way in to them.

``tests/kernel/test_jit.py`` runs this folder in a process where nothing is compiled.
"""

import sys
from pathlib import Path

import pytest

from ftqp.kernel.jit import COMPILED

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave them to that process."""
    if COMPILED:
        mark = pytest.mark.skip(reason="run as plain Python by tests/kernel/test_jit.py")
        for item in items:
            if HERE in item.path.parents:
                item.add_marker(mark)
