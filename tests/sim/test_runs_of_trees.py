"""Runs of robots with several tips: plants, joints that fail in either arm, and what is refused."""

import numpy as np
import pytest
from tests.model.random_robots import random_robot

import ftqp
from ftqp.model.serial import Inertial
from ftqp.sim.plants.plant import Arm
from ftqp.sim.session.frame import DrawnArm

DT = 2e-3
DUAL = ftqp.robots.load("dual_panda")
CIRCLE = ftqp.paths.Circle(DUAL.pose(DUAL.neutral), 0.08, duration=2.0)


def run(plant=None, schedule=(), robot=DUAL, **settings):
    planner = ftqp.Planner(robot, dt=DT, **settings)
    return ftqp.Simulation(
        planner, CIRCLE, q=robot.neutral, plant=plant, schedule=ftqp.Schedule(schedule), log="memory"
    ).run()


LOCKS = [
    ftqp.FaultEvent(0.3, ftqp.Locked("left_joint3")),
    ftqp.FaultEvent(0.6, ftqp.Locked("right_joint2")),
]


@pytest.mark.parametrize("backend", ["active_set", "dtrnn"])
def test_one_arm_follows_as_it_does_alone_and_the_other_stands(backend, level):
    alone = ftqp.robots.load("panda")
    planner = ftqp.Planner(alone, dt=DT, level=level, backend=backend)
    path = ftqp.paths.Circle(alone.pose(alone.neutral), 0.08, duration=2.0)
    lock = ftqp.Schedule([ftqp.FaultEvent(0.3, ftqp.Locked("panda_joint3"))])
    single = ftqp.Simulation(planner, path, q=alone.neutral, schedule=lock, log="memory").run()
    both = run(schedule=LOCKS, level=level, backend=backend)
    assert both.completed
    found, expected = both.log["position_error"], single.log["position_error"]
    assert np.abs(found - expected).max() < 1e-3
    assert np.array_equal(both.log["q"][:, 7:], np.tile(DUAL.neutral[7:], (len(both.log), 1)))


def test_physics_follows_with_a_lock_in_either_arm(level):
    pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    found = run(ftqp.MujocoPlant(DUAL, DT), LOCKS, level=level)
    assert found.completed
    assert found.log["position_error"].max() < 0.02
    assert np.abs(found.q[7:] - DUAL.neutral[7:]).max() < 1e-3


@pytest.mark.parametrize("count", [3, 8, 20])
def test_physics_has_the_equations_of_motion_of_a_tree(count):
    pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    from ftqp.sim.plants.physics import Physics

    rng = np.random.default_rng(count)
    robot, _ = random_robot(rng, count)
    physics = Physics(robot.chain, 1e-3)
    for _ in range(3):
        q, v = rng.uniform(-2.0, 2.0, count), rng.uniform(-1.0, 1.0, count)
        physics.reset(q, v)
        M, h = robot.mass_matrix(q), robot.bias(q, v) - robot.viscous * v
        np.testing.assert_allclose(physics.mass_matrix(), M, rtol=0.0, atol=1e-11 * np.abs(M).max())
        np.testing.assert_allclose(physics.tip(), robot.pose(q), rtol=0.0, atol=1e-11)
        np.testing.assert_allclose(physics.bias, h, rtol=0.0, atol=1e-11 * np.abs(h).max())


def test_a_joint_that_nobody_knows_of_swings_by_its_own_equation_of_motion():
    i = DUAL.joint("right_joint4")
    found = run(schedule=[ftqp.FaultEvent(0.1, ftqp.FreeSwinging("right_joint4"), "never")])
    q, v = found.log["q"], found.log["v"]
    first = round(0.1 / DT) + 1
    assert np.abs(v[first + 20, i]) > 0.05
    for k in range(first, first + 20):
        middle, speed = 0.5 * (q[k] + q[k + 1]), 0.5 * (v[k] + v[k + 1])
        speed[: DUAL.joint("right_joint1")] = 0.0  # the arms share a base that stands
        a = (v[k + 1] - v[k]) / DT
        h = DUAL.bias(middle, speed)[i]
        assert a[i] == pytest.approx(-h / DUAL.mass_matrix(middle)[i, i], rel=0.02)


def test_a_planner_told_of_a_free_joint_and_a_run_that_would_tell_it_are_refused():
    said = "reporting a free-swinging joint needs one serial arm, but dual_panda has joints"
    planner = ftqp.Planner(DUAL, dt=DT)
    planner.reset(DUAL.neutral)
    with pytest.raises(ftqp.InputError, match=said):
        planner.report(ftqp.FreeSwinging("right_joint2"))
    assert not planner.faults
    with pytest.raises(ftqp.InputError, match=said):
        run(schedule=[ftqp.FaultEvent(0.1, ftqp.FreeSwinging("right_joint2"))])
    one = ftqp.Robot.from_pinocchio(DUAL.model, "left_hand", limits={"a_max": 10.0})
    ftqp.Planner(one, dt=DT).report(ftqp.FreeSwinging("left_joint2"))


@pytest.mark.parametrize("scheme", ["pseudoinverse", "singularity_robust"])
def test_closed_forms_of_the_jacobian_serve_trees(scheme):
    found = run(scheme=scheme, level="velocity")
    assert found.completed
    assert found.log["position_error"].max() < 0.02


def test_the_closed_form_of_a_spherical_wrist_needs_a_serial_arm():
    with pytest.raises(ftqp.InputError, match="approximate_pseudoinverse needs one serial arm"):
        ftqp.Planner(DUAL, dt=DT, level="velocity", scheme="approximate_pseudoinverse")


def test_drawn_arms_and_records_are_where_the_model_is():
    rng = np.random.default_rng(2)
    robot, _ = random_robot(rng, 14)
    q = rng.uniform(-2.0, 2.0, 14)
    poses = DrawnArm(robot).joints(q)
    np.testing.assert_allclose(poses[-1], robot.pose(q), atol=1e-12)
    for i, name in enumerate(robot.joints):
        np.testing.assert_allclose(poses[i, :3, 3], robot.pose(q, name)[:3, 3], atol=1e-12)
    np.testing.assert_allclose(Arm(robot).tip(q), robot.pose(q), atol=1e-12)


@pytest.mark.parametrize("arm", ["panda", "dual_panda"])
def test_arm_and_base_make_up_for_each_other(arm):
    body = Inertial(mass=60.0, com=np.zeros(3), inertia=np.diag([3.0, 3.0, 4.0]))
    robot = ftqp.robots.load(arm).on_planar_base(v_max=[0.5, 0.5, 1.0], a_max=[1.0, 1.0, 2.0], inertial=body)
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.3, duration=12.0)
    for joint, still in (("base_x", True), (robot.joints[6], False)):
        planner = ftqp.Planner(robot, dt=4e-3)
        lock = ftqp.Schedule([ftqp.FaultEvent(3.0, ftqp.Locked(joint))])
        found = ftqp.Simulation(planner, path, q=robot.neutral, schedule=lock, log="memory").run()
        assert found.completed
        assert found.log["position_error"].max() < 5e-3
        assert (np.ptp(found.log["q"][-500:, 0]) == 0.0) == still
        assert np.ptp(found.log["q"][:, :2], axis=0).max() > 0.2
