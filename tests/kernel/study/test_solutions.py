"""All self-motions of a goal: as many as there are, whoever shares out the work."""

import numpy as np
import pytest
from studies import at, starts, study_of, unit_arm

from ftqp.core.errors import InputError
from ftqp.model import catalog


def test_three_unit_links_have_two_self_motions_inside_one_metre_and_one_outside() -> None:
    study = study_of(unit_arm(), (0, 1))
    radii = np.linspace(0.05, 2.95, 30)
    goals = [at(r * np.cos(5.0 * r), r * np.sin(5.0 * r)) for r in radii]
    found = study.spread_curves(np.array(goals), starts(3), points=20, quiet=16, curves=4)
    assert found.counts.tolist() == [2 if r < 1.0 else 1 for r in radii]


def test_points_of_a_curve_lie_on_it_at_equal_arcs() -> None:
    robot = unit_arm()
    study = study_of(robot, (0, 1))
    goals = np.array([at(1.5, 1.5), at(-0.8, 0.0)])
    found = study.spread_curves(goals, starts(3), points=400, quiet=16, curves=4)
    for k, j in ((0, 0), (1, 0), (1, 1)):
        q = found.q[k, j]
        assert max(np.abs(robot.pose(p)[:2, 3] - goals[k][:2, 3]).max() for p in q) < 1e-12
        closing = q[0] + 2.0 * np.pi * found.winding[k, j]
        chords = np.linalg.norm(np.diff(np.vstack([q, closing]), axis=0), axis=1)
        assert chords == pytest.approx(found.lengths[k, j] / 400, rel=1e-3)


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
