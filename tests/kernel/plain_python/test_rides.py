"""Every way in which a planner can be made and led runs as plain Python, and within its limits."""

import numpy as np
import pytest
from rides import RIDES


def numbers(said):
    """All numbers of nested lists."""
    return [x for part in said for x in numbers(part)] if isinstance(said, list) else [float(said)]


@pytest.mark.slow
@pytest.mark.parametrize("name", RIDES)
def test_a_ride_commands_numbers(name):
    assert np.isfinite(numbers(RIDES[name]())).all()
