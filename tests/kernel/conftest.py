"""Modules that several tests of the kernel share live beside them."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent))


@pytest.fixture(autouse=True)
def quiet_numbers():
    """Formulas that run as plain Python do not warn of infinities and NaN, as compiled code does not."""
    with np.errstate(all="ignore"):
        yield
