"""Python processes that are started meanwhile import nothing from the folder in which the user works."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

SAFE_PATH = "PYTHONSAFEPATH"
"""What a Python that is started as ``python -c`` heeds; else it would import a stranger's files there."""


@contextmanager
def safe_path() -> Iterator[None]:
    """While entered, processes that are started keep the current folder out, and no others do."""
    before = os.environ.get(SAFE_PATH)
    os.environ[SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[SAFE_PATH]
        else:
            os.environ[SAFE_PATH] = before
