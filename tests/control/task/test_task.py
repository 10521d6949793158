"""A task says which rows are followed, with stable gains, in a mode that exists."""

import numpy as np
import pytest

from ftqp.control.task.task import DEFAULT_GAINS, Task, axis_frame, checked_gains, row_indices
from ftqp.core.errors import InputError


@pytest.mark.parametrize(
    ("rows", "indices"),
    [
        ("pose", (0, 1, 2, 3, 4, 5)),
        ("position", (0, 1, 2)),
        ("position_axis", (0, 1, 2, 3, 4)),
        (("rz", "x"), (0, 5)),
        (["z"], (2,)),
    ],
)
def test_row_sets_become_sorted_components(rows, indices):
    assert row_indices(rows) == indices


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (
            {"rows": "positon"},
            r"task rows 'positon' are unknown \(did you mean 'position'\?\); expected one of pose, ",
        ),
        ({"rows": ("x", "w")}, "task row 'w' is unknown; rows are x, y, z, rx, ry, rz"),
        ({"rows": ("x", "x")}, r"task rows are \('x', 'x'\), expected at least one row and none twice"),
        ({"rows": ()}, r"task rows are \(\), expected at least one row and none twice"),
        (
            {"mode": "scale"},
            r"task mode is 'scale' \(did you mean 'scaled'\?\), expected one of hard, slack, ",
        ),
        (
            {"priority": "position"},
            r"task priority is 'position' \(did you mean 'position_first'\?\), expected one of weighted, ",
        ),
        (
            {"priority": "position_first", "mode": "hard"},
            "priority 'position_first' does not go with mode 'hard': the rows of the mode",
        ),
        ({"kp": -1.0}, "kp is -1, expected a finite number >= 0"),
        ({"kv": np.nan}, "kv is nan, expected a finite number >= 0"),
        ({"length": 0.0}, "length is 0, expected a finite number > 0 m"),
        ({"slack": 0.0}, "slack is 0, expected a finite number > 0"),
        ({"slack": 2.0}, r"slack is 2, expected a share in \[1e-12, 1\]"),
        ({"axis": (0.0, 0.0, 0.0)}, "axis is zero, expected the direction of the tool"),
        ({"axis": (0.0, 1.0)}, r"axis has shape \(2,\), expected \(3,\)"),
    ],
)
def test_wrong_task_is_refused_with_one_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence):
        Task(**given)


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_gains_default_by_level(level):
    assert Task().gains(level) == DEFAULT_GAINS[level]


def test_acceleration_feedback_is_critically_damped_unless_told():
    assert Task(kp=25.0).gains("acceleration") == (25.0, 10.0)
    assert Task(kp=25.0, kv=3.0).gains("acceleration") == (25.0, 3.0)
    kp, kv = DEFAULT_GAINS["acceleration"]
    assert kv == 2.0 * kp**0.5


@pytest.mark.parametrize(("level", "given"), [("acceleration", {"kv": 200.0}), ("velocity", {"kp": 200.0})])
def test_gains_at_the_edge_of_stability_are_refused_and_below_it_pass(level, given):
    name = next(iter(given))
    with pytest.raises(InputError, match=rf"{name} is 200, but with dt = 0.01 s .* expected {name} < 200"):
        checked_gains(Task(**given), level, 0.01)
    checked_gains(Task(**given), level, 0.0099)


@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0), (0, -3, 0), (1, 2, -2)])
def test_axis_frame_is_a_rotation_whose_third_column_is_the_axis(axis):
    R = axis_frame(axis)
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-15)
    assert np.linalg.det(R) > 0.0
    np.testing.assert_allclose(R[:, 2], np.array(axis) / np.linalg.norm(axis), atol=1e-15)
