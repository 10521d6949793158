"""Joint limits."""

import numpy as np
import pytest

from ftqp.core.errors import InputError
from ftqp.model.limits import JointLimits


def test_limits_are_read_only_and_do_not_share_memory_with_what_was_given() -> None:
    given = np.ones(2)
    limits = JointLimits(q_min=-given, q_max=given, v_max=given, a_max=given, tau_max=given)
    given[0] = 9.0
    assert limits.v_max[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        limits.v_max[0] = 2.0


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ([1.0, 2.0], r"v_max has shape \(2,\), expected \(nv,\) = \(3,\)"),
        ("fast", "v_max is not an array of numbers"),
    ],
)
def test_wrong_limits_are_named(value: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        JointLimits.of(3, v_max=value)


def test_unknown_limit_names_the_nearest() -> None:
    with pytest.raises(InputError, match=r"'vmax' is not a limit .*did you mean 'v_max'"):
        JointLimits.of(1).replaced({"vmax": 1.0})
