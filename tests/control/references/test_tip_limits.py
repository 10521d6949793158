"""Limits of a reference of the tip."""

import pytest

import ftqp


@pytest.mark.parametrize("name", ["speed", "acceleration", "turn", "turn_acceleration", "rise_time"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_limit_that_is_not_positive_is_refused_by_name(name, value):
    with pytest.raises(ftqp.InputError, match=name):
        ftqp.TipLimits(**{name: value})
