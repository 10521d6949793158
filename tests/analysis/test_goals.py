"""Goals and rows of studies."""

import numpy as np
import pytest
from planar_arms import links

from ftqp.analysis.goals import goal_study
from ftqp.control.inverse_kinematics.arm_study import row_names
from ftqp.core.errors import InputError
from ftqp.model import catalog


def test_named_sets_are_those_of_the_robots_own_rows() -> None:
    planar, panda = links(1, 1, 1), catalog.load("panda")
    assert row_names(planar, "pose") == row_names(planar, "position") == ("x", "y")
    assert row_names(panda, "position") == ("x", "y", "z")
    assert len(row_names(panda, "pose")) == 6
    assert row_names(planar, ("x", "y", "rz")) == ("x", "y", "rz")


@pytest.mark.parametrize(
    ("goal", "rows", "sentence"),
    [
        ((1.0, 2.0, 3.0, 4.0), "pose", r"shape \(4,\), expected a point"),
        ((1.0, np.nan), "pose", "contains NaN"),
        ((1.0, 1.0), ("x", "y", "rz"), "give a pose"),
        ((1.0, 1.0), ("x", "z"), r"give a point \(3,\)"),
        ((1.0, 1.0, 0.0), ("x", "y", "z"), "do not move independently"),
        ((1.0, 1.0), "position_axis", "expected 'pose', 'position' or names"),
        (np.ones((4, 4)), "pose", "not a rotation"),
    ],
)
def test_goal_that_does_not_fit_its_rows_is_refused(goal: object, rows: object, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        goal_study(links(1, 1, 1), goal, rows)
