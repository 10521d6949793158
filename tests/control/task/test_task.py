"""A task says which rows are followed, with stable gains, in a mode that exists."""

import dataclasses
from dataclasses import astuple

import numpy as np
import pytest

from ftqp.control.task import bounds, schemes
from ftqp.control.task.bounds import Jin, OneStep, Viability
from ftqp.control.task.scheme import Criterion, Scheme
from ftqp.control.task.task import DEFAULT_GAINS, EmergencyStop, Task, axis_frame, checked_gains, row_indices
from ftqp.core.errors import InputError
from ftqp.kernel.layout import enums as codes


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
        ({"rows": "positon"}, r"task rows 'positon' are unknown \(did you mean 'position'\?\); expected"),
        ({"rows": ("x", "w")}, "task row 'w' is unknown; rows are x, y, z, rx, ry, rz"),
        ({"rows": ("x", "x")}, r"task rows are \('x', 'x'\), expected at least one row and none twice"),
        ({"rows": ()}, r"task rows are \(\), expected at least one row and none twice"),
        ({"mode": "scale"}, r"mode is 'scale' \(did you mean 'scaled'\?\), expected one of hard,"),
        ({"priority": "position"}, r"priority is 'position' \(did you mean 'position_first'\?\),"),
        ({"priority": "position_first", "mode": "hard"}, "priority 'position_first' does not go with mode"),
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


def test_every_conversion_is_known_by_name_by_its_table_and_as_itself():
    assert bounds.names() == ("viability", "jin", "one_step")
    for name, kind, code in zip(
        bounds.names(), (Viability, Jin, OneStep), (codes.VIABILITY, codes.JIN, codes.ONE_STEP), strict=True
    ):
        assert bounds.by_name(name) == kind() and kind.code == code
    assert bounds.by_name({"name": "jin", "gamma_p": 5.0, "margin": 0.0}) == Jin(gamma_p=5.0, margin=0.0)
    mine = Jin(gamma_v=3.0)
    assert bounds.by_name(mine) is mine


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("viable", r"'viable' is not a bound conversion \(did you mean 'viability'\?\); there are"),
        ("", "'' is not a bound conversion; there are viability, jin, one_step"),
        ({"gamma_p": 1.0}, "None is not a bound conversion"),
        ({"name": "jin", "gama_p": 1.0}, r"'gama_p' is not a parameter of bounds 'jin' \(did you mean"),
        ({"name": "viability", "margin": 0.1}, "'margin' is not a parameter of bounds 'viability'; it has"),
        ({"name": "jin", "gamma_p": 0.0}, "gamma_p is 0, expected a finite number > 0"),
        ({"name": "jin", "upsilon": np.inf}, "upsilon is inf, expected a finite number > 0"),
        ({"name": "jin", "margin": -0.1}, "margin is -0.1, expected a finite number >= 0 rad"),
    ],
)
def test_wrong_conversion_is_refused_with_one_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence):
        bounds.by_name(given)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"position": 0.0}, "position is 0, expected a finite number > 0 m"),
        ({"rotation": np.inf}, "rotation is inf, expected a finite number > 0 rad"),
        ({"samples": 0}, "samples is 0, expected a whole number >= 1"),
        ({"samples": 2.5}, "samples is 2.5, expected a whole number >= 1"),
    ],
)
def test_senseless_stop_is_refused_with_one_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence):
        EmergencyStop(**given)


def test_it_stops_by_default_beyond_five_centimetres_or_three_tenths_of_a_radian():
    stop = EmergencyStop()
    assert (stop.position, stop.rotation, stop.samples) == (0.05, 0.3, 3)
    assert EmergencyStop(samples=1).samples == 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        stop.position = 1.0


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_mixed_scheme_is_the_weighted_sum_at_both_levels(level):
    mixed = 2.0 * schemes.mke() + schemes.rmp() * 3.0
    expected = 2.0 * np.array(astuple(schemes.mke().at(level))) + 3.0 * np.array(
        astuple(schemes.rmp().at(level))
    )
    np.testing.assert_allclose(astuple(mixed.at(level)), expected, rtol=1e-15)
    assert mixed.name == "2 mke + 3 rmp"


def test_negative_weight_is_refused():
    with pytest.raises(InputError, match="the weight of a scheme is -1, expected a finite number >= 0"):
        -1.0 * schemes.mvn()


def test_scheme_without_a_weight_is_refused_with_the_level():
    empty = Scheme(name="empty", acceleration=Criterion(norm=1.0), velocity=Criterion())
    assert empty.at("acceleration").norm == 1.0
    with pytest.raises(InputError, match="scheme 'empty' has no weight at the velocity level"):
        empty.at("velocity")
