"""Null vectors and minors, what is left without some joints, and joints that a task can never do without."""

import numpy as np
import pinocchio as pin
import pytest

import ftqp
from ftqp.analysis.survival.continuing import track
from ftqp.analysis.survival.task_path import task_path
from ftqp.analysis.tolerance import (
    minors,
    null_vector,
    relative_manipulability,
    structural_joints,
    velocity_jump,
)
from ftqp.control.paths import Line
from ftqp.model import catalog

DRAWN = np.random.default_rng(7).normal(size=(1000, 6, 7))


def test_null_vector_times_manipulability_is_the_minors() -> None:
    n, Z = null_vector(DRAWN), minors(DRAWN)
    w = np.sqrt(np.linalg.det(DRAWN @ np.swapaxes(DRAWN, 1, 2)))
    assert (np.linalg.norm(w[:, None] * n - Z, axis=1) < 1e-9 * np.linalg.norm(Z, axis=1)).all()
    assert np.abs(np.einsum("kmn,kn->km", DRAWN, n)).max() < 1e-12


def test_null_vector_keeps_its_sign_along_a_path_and_under_units_of_rows() -> None:
    panda = catalog.load("panda")
    q0 = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
    task = task_path(panda, Line(panda.pose(q0), (0.0, 0.3, 0.1), duration=4.0), dt=0.02)
    J = np.stack([panda.jacobian(one) for one in track(task, q0, 0.5)])
    n = null_vector(J)
    assert (np.einsum("ki,ki->k", n[1:], n[:-1]) > 0.99).all()
    scaled = J * np.array([1000.0, 1000.0, 1000.0, 57.3, 57.3, 57.3])[:, None]
    assert np.allclose(null_vector(scaled), n, atol=1e-9)


def test_planar_minors_are_those_of_the_formula() -> None:
    arm = catalog.load("planar", lengths=(1.0, 1.0, 1.0))
    q = np.array([0.3, 0.7, -1.1])
    (s2, s3), s23 = np.sin(q[1:]), np.sin(q[1] + q[2])
    wanted = np.array([s3, -(s3 + s23), s2 + s23])
    assert np.allclose(minors(arm.jacobian(q)[:2]), wanted)


RANDOM = np.random.default_rng(3).normal(size=(300, 6, 7))


def manipulability(J):
    return np.sqrt(np.linalg.det(J @ np.swapaxes(J, -1, -2)))


def test_relative_manipulability_is_the_ratio_of_both() -> None:
    share = relative_manipulability(RANDOM)
    for j in range(7):
        without = manipulability(np.delete(RANDOM, j, axis=2))
        assert np.allclose(share[:, j], without / manipulability(RANDOM))
    assert np.allclose(share, np.abs(null_vector(RANDOM)))
    wide = RANDOM[:, :4]
    pairs = [(0, 1), (2, 5), (1, 3, 6)]
    for share, failed in zip(relative_manipulability(wide, pairs).T, pairs, strict=True):
        assert np.allclose(share, manipulability(np.delete(wide, failed, axis=2)) / manipulability(wide))
    assert (relative_manipulability(RANDOM, [(0, 1)]) == 0.0).all()


def test_jump_stops_the_joint_and_keeps_the_task() -> None:
    rng = np.random.default_rng(5)
    for J in (*RANDOM[:20], *RANDOM[:20, :4]):
        v, j = rng.normal(size=7), int(rng.integers(7))
        jump = velocity_jump(J, v, j)
        assert abs(v[j] + jump[j]) < 1e-9 and np.abs(J @ jump).max() < 1e-9
        assert np.isclose(np.linalg.norm(jump), abs(v[j]) / relative_manipulability(J)[j], rtol=1e-8)
        if len(J) == 6:
            assert np.allclose(jump, -v[j] / null_vector(J)[j] * null_vector(J), atol=1e-8)


def test_joint_that_is_needed_has_no_jump_unless_it_stands() -> None:
    J = np.eye(3, 4)
    assert np.isinf(velocity_jump(J, (1.0, 0.0, 0.0, 0.0), 0)).all()
    assert (velocity_jump(J, (0.0, 1.0, 0.0, 0.0), 0) == 0.0).all()


def test_elbow_between_spherical_wrists_is_structural_with_a_pose_only() -> None:
    for name in ("iiwa14", "srs7"):
        arm = catalog.load(name)
        assert structural_joints(arm) == (arm.joints[3],)
        assert structural_joints(arm, "position") == ()
    assert structural_joints(catalog.load("panda")) == structural_joints(catalog.load("zhang7")) == ()


def test_every_joint_counts_where_there_are_as_many_as_rows() -> None:
    puma = catalog.load("puma560")
    assert structural_joints(puma) == puma.joints


POSTURE = [0.3, 0.6, 0.2, -1.2, 0.3, 1.6, 0.4]


@pytest.mark.parametrize("name", ["panda", "iiwa14", "xarm7"])
def test_energy_is_the_potential_energy_lost_on_the_way_to_the_stop(name):
    robot = ftqp.robots.load(name)
    q = robot.neutral + np.linspace(0.1, 0.4, 7)
    data = robot.model.createData()
    fell = 0
    for i, energy in enumerate(ftqp.analysis.fall_energy(robot, q).values()):
        ends = []
        for stop in (robot.limits.q_min[i], robot.limits.q_max[i]):
            way = np.linspace(q[i], stop, 400)
            lost = []
            for angle in way:
                moved = q.copy()
                moved[i] = angle
                lost.append(pin.computePotentialEnergy(robot.model, data, moved))
            gained = lost[0] - np.array(lost[1:])
            ends.append(gained[-1] if (gained > 0.0).all() else 0.0)
        assert energy == pytest.approx(max(ends), abs=0.02 * max(1.0, max(ends)))
        fell += energy > 1.0
    assert fell >= 1
