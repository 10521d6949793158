"""Branch limits narrow a joint's own range and never widen it."""

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError
from ftqp.model.limits import within_branch


@pytest.fixture(scope="module")
def puma():
    return ftqp.robots.load("puma560")


def test_range_is_the_intersection_with_the_joints_own(puma):
    found = within_branch(puma, {"j3": (-1.4, np.inf), 1: (-99.0, 0.5)})
    assert found.limits.q_min[2] == -1.4 and found.limits.q_max[2] == puma.limits.q_max[2]
    assert found.limits.q_min[1] == puma.limits.q_min[1] and found.limits.q_max[1] == 0.5
    np.testing.assert_array_equal(found.limits.q_min[3:], puma.limits.q_min[3:])
    assert np.all((found.neutral >= found.limits.q_min) & (found.neutral <= found.limits.q_max))


@pytest.mark.parametrize(
    ("limits", "sentence"),
    [
        ({"j9": (0.0, 1.0)}, "'j9' is not a joint of puma560"),
        ({"j3": 1.0}, r"branch limits of j3 are 1.0, expected \(low, high\)"),
        ({"j3": (0.0, 1.0, 2.0)}, r"branch limits of j3 are .*, expected \(low, high\)"),
        ({"j3": (np.nan, 1.0)}, r"branch limits of j3 are \(nan, 1\), expected numbers"),
        (
            {"j3": (1.0, 2.0)},
            r"branch limits of j3 leave nothing: \(1, 2\) of its range \[-3.92699, 0.785398\]",
        ),
    ],
)
def test_wrong_branch_is_one_clear_sentence(puma, limits, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.Planner(puma, branch_limits=limits)
