"""Traced self-motions: they close, keep the tip, and have the lengths that finer steps find."""

import numpy as np
import pytest
from studies import at, starts, study_of, unit_arm

from ftqp.kernel.layout.enums import CurveEnd
from ftqp.model import catalog


@pytest.mark.parametrize(("x", "length"), [((1.5, 1.5), 13.1779), ((2.0, -1.4), 10.3154)])
def test_self_motion_of_three_links_closes_at_its_length(x: tuple[float, float], length: float) -> None:
    robot = unit_arm()
    study = study_of(robot, (0, 1))
    study.aim(at(*x))
    (curve,) = study.self_motions(starts(3), quiet=16)
    assert curve.end is CurveEnd.CLOSED
    assert curve.length == pytest.approx(length, abs=1e-3)
    assert not curve.crossed
    assert curve.winding.tolist() == [0, 0, 0]
    assert max(np.abs(robot.pose(q)[:2, 3] - x).max() for q in curve.q) < 1e-12
    chords = np.linalg.norm(np.diff(curve.q, axis=0), axis=1)
    assert chords.max() < 0.0751
    assert curve.parts[0] == pytest.approx(np.linalg.norm(curve.q[-1] - curve.q[0]), abs=1e-12)


def test_length_of_a_curve_does_not_depend_on_the_step() -> None:
    lengths = []
    for step in (0.1, 0.01):
        study = study_of(unit_arm(), (0, 1), step)
        study.aim(at(1.5, 1.5))
        lengths.append(study.self_motions(starts(3), quiet=16)[0].length)
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-5)


def test_joint_that_turns_right_round_says_so() -> None:
    study = study_of(unit_arm(), (0, 1))
    study.aim(at(-0.8, 0.0))
    curves = study.self_motions(starts(3), quiet=16)
    assert [abs(curve.winding).tolist() for curve in curves] == [[1, 0, 0]] * 2


def test_crossing_of_a_self_motion_with_itself_is_flagged() -> None:
    for x, crossed in ((1.0, True), (0.999, False), (1.001, False)):
        study = study_of(unit_arm(), (0, 1))
        study.aim(at(x, 0.0))
        curves = study.self_motions(starts(3), quiet=16)
        assert all(curve.crossed is crossed for curve in curves)


def test_curve_ends_at_joint_limits_and_nowhere_else() -> None:
    robot = catalog.load("planar", lengths=(1, 1, 1))
    study = study_of(robot, (0, 1), limited=True)
    study.aim(at(1.0, 0.3))
    low, high = robot.limits.q_min, robot.limits.q_max
    curves = study.self_motions(starts(3, 256), quiet=64)
    assert curves
    for curve in curves:
        assert curve.end is CurveEnd.CUT
        assert (curve.q >= low).all()
        assert (curve.q <= high).all()
        for q in (curve.q[0], curve.q[-1]):
            assert min(np.abs(q - low).min(), np.abs(high - q).min()) < 1e-10
        assert max(np.abs(robot.pose(q)[:2, 3] - (1.0, 0.3)).max() for q in curve.q) < 1e-12
        assert curve.length == pytest.approx(np.linalg.norm(np.diff(curve.q, axis=0), axis=1).sum(), rel=1e-3)


def test_curve_without_room_is_unfinished() -> None:
    study = study_of(unit_arm(), (0, 1))
    study.aim(at(1.5, 1.5))
    q, _, _ = study.solutions(starts(3)[:1])
    assert study.curve(q[0], most=40).end is CurveEnd.UNFINISHED
