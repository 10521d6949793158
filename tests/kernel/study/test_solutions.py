"""All self-motions of a goal: as many as there are, whoever shares out the work."""

import numpy as np
import pinocchio as pin
import pytest
from random_chains import random_robot
from studies import at, starts, study_of, unit_arm

from ftqp.core.errors import InputError
from ftqp.kernel.layout.enums import CurveEnd
from ftqp.model import catalog
from ftqp.model.robot import Robot


def test_self_motions_do_not_depend_on_the_number_of_threads() -> None:
    study = study_of(unit_arm(), (0, 1))
    goals = np.array([at(x, 0.4) for x in np.linspace(0.1, 2.5, 17)])
    one, two = (
        study.spread_curves(goals, starts(3), points=30, quiet=16, curves=4, threads=k) for k in (1, 2)
    )
    assert np.array_equal(one.q, two.q, equal_nan=True)
    assert one.counts.tolist() == two.counts.tolist()


def test_pose_of_a_spherical_arm_has_eight_self_motions() -> None:
    robot = catalog.load("iiwa14")
    study = study_of(robot, range(6))
    study.aim(robot.pose(robot.neutral + 0.2))
    curves = study.self_motions(starts(7, 512), quiet=60)
    assert len(curves) == 8
    assert [curve.length for curve in curves] == pytest.approx([curves[0].length] * 8, rel=1e-6)
    for curve in curves:  # the elbow stands still
        assert np.ptp(curve.q[:, 3]) < 1e-9


def test_solution_of_held_and_bounded_joints_stays_with_them() -> None:
    robot = catalog.load("panda")
    study = study_of(robot, (0, 1, 2), limited=True)
    goal = robot.pose(robot.neutral)
    study.aim(goal)
    study.hold([1, 3])
    rng = np.random.default_rng(7)
    begin = rng.uniform(robot.limits.q_min, robot.limits.q_max, (40, 7))
    begin[:, [1, 3]] = robot.neutral[[1, 3]]
    q, left, sigma = study.solutions(begin, bounded=True)
    done = left < 1e-11
    assert done.sum() > 20
    assert (q[:, [1, 3]] == robot.neutral[[1, 3]]).all()
    assert ((q >= robot.limits.q_min) & (q <= robot.limits.q_max)).all()
    assert max(np.abs(robot.pose(p)[:3, 3] - goal[:3, 3]).max() for p in q[done]) < 1e-11
    assert (sigma[done] > 0.0).all()


def test_goal_with_more_self_motions_than_room_is_refused() -> None:
    study = study_of(unit_arm(), (0, 1))
    study.aim(at(-0.8, 0.0))
    with pytest.raises(InputError, match="more than 1 self-motions"):
        study.self_motions(starts(3), quiet=16, curves=1)


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


ROWS = [(0, 1, 2, 3, 4, 5), (0, 1, 2), (0, 2, 4), (1, 5)]
STEP = 1e-6


def error(robot: Robot, rows: tuple[int, ...], q: np.ndarray, goal: np.ndarray) -> np.ndarray:
    pose = robot.pose(q)
    turn = pin.log3(goal[:3, :3] @ pose[:3, :3].T)
    return np.concatenate([goal[:3, 3] - pose[:3, 3], robot.length * turn])[list(rows)]


@pytest.mark.parametrize("rows", ROWS)
def test_values_of_any_chain_are_those_of_pinocchio(rows: tuple[int, ...]) -> None:
    rng = np.random.default_rng(3)
    robot = random_robot(rng, 12)
    study = study_of(robot, rows)
    goal = robot.pose(rng.uniform(-1.0, 1.0, 12))
    study.aim(goal)
    q = rng.uniform(-1.0, 1.0, (5, 12))
    e, A, D, H = study.values(q, rates=True)
    scale = np.array([1.0, 1.0, 1.0, *[robot.length] * 3])
    for k in range(5):
        assert e[k] == pytest.approx(error(robot, rows, q[k], goal), abs=1e-12)
        J = (scale[:, None] * robot.jacobian(q[k]))[list(rows)]
        assert pytest.approx(J, abs=1e-12) == A[k]
        for l in range(12):
            d = STEP * np.eye(12)[l]
            rate = (error(robot, rows, q[k] - d, goal) - error(robot, rows, q[k] + d, goal)) / (2.0 * STEP)
            assert D[k, :, l] == pytest.approx(rate, abs=1e-7)
            both = [(scale[:, None] * robot.jacobian(q[k] + s * d))[list(rows)] for s in (1.0, -1.0)]
            assert H[k, l] == pytest.approx((both[0] - both[1]) / (2.0 * STEP), abs=1e-7)
