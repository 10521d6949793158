"""Detectors on arms in physics: led round circles, at rest, and behind MuJoCo's own position servos."""

import mujoco
import numpy as np
import pytest

import ftqp
from ftqp.sim.plants.troubled_plant import Jammed, Weakened

DT, SIGMA, BANDWIDTH = 1e-3, 1e-4, 94.0
AT, FREED = 1.0, 1.5


def led(drive, happens=lambda k, plant, planner: None, *, ticks, radius=0.08, friction=None, **settings):
    """A Panda led round circles, or to stand where the radius is 0, and the true errors of its tip [m]."""
    robot = ftqp.robots.load("panda")
    robot = robot if friction is None else robot.with_friction(coulomb=friction)
    made = {} if drive == "torque" else {"bandwidth": BANDWIDTH}
    if drive == "torque" and not radius:  # an arm that has not moved has learned nothing: its model is right
        made = {"inertia_error": 0.0}
    planner = ftqp.Planner(
        robot, DT, drive=ftqp.Drive(kind=drive, **made), noise=ftqp.Noise(q=SIGMA),
        **settings,
    )  # fmt: skip
    servo = ftqp.JointServo(robot, drive, **({} if drive == "torque" else {"bandwidth": BANDWIDTH}))
    plant = ftqp.MujocoPlant(robot, DT, servo, substeps=2 if radius else 4)
    sensors = ftqp.JointSensors(robot, DT, position_noise=SIGMA, seed=1)
    planner.reset(robot.neutral)
    plant.reset(robot.neutral, np.zeros(7))
    sensors.reset()
    start = robot.pose(robot.neutral)
    path = (
        ftqp.paths.Circle(start, radius, duration=6.0, axes=("y", "z"))
        if radius
        else ftqp.paths.Hold(start, duration=6.0)
    )
    sample = path.sample(np.mod(DT * np.arange(ticks), path.duration))
    targets = ftqp.Targets(sample.pose, sample.twist, sample.acceleration)
    errors = np.zeros(ticks)
    for k in range(ticks):
        happens(k, plant, planner)
        sensors.measure(plant.q, plant.v)
        plant.advance(planner.step(sensors.q, None, targets.at(k)))
        errors[k] = np.linalg.norm(robot.pose(plant.q)[:3, 3] - sample.pose[k, :3, 3])
    return planner, errors


def jam(joint):
    """A joint is held for half a second."""

    def happens(k, plant, planner):
        if k == round(AT / DT):
            plant.suffer(Jammed(joint))
        if k == round(FREED / DT):
            plant.suffer(Weakened(joint, 1.0))

    return happens


def lock(joint):
    """A brake closes, and nobody announces it."""

    def happens(k, plant, planner):
        if k == round(AT / DT):
            plant.fail(ftqp.Locked(joint))

    return happens


def standing(drive, happens=lambda k, plant, planner: None, **settings):
    """The same of an arm that is to hold its tip where it is."""
    return led(drive, happens, radius=0.0, task=ftqp.Task(rows="position"), **settings)


@pytest.mark.long
@pytest.mark.parametrize(("drive", "joint"), [("position", 2), ("velocity", 3), ("torque", 3)])
def test_a_joint_that_was_jammed_for_half_a_second_goes_on_being_used(drive, joint):
    planner, errors = led(drive, jam(joint), ticks=3800)
    name = planner.robot.joints[joint]
    assert {finding.joint for finding in planner.findings} == {name}
    assert all(finding.withdrawn_at is not None for finding in planner.findings)
    assert FREED < planner.findings[-1].withdrawn_at < 4.0
    assert planner.faults == {}
    most = 0.03 if drive == "torque" else 0.04  # nothing holds the joint of a torque arm once it is let go
    assert errors.max() < most and errors[-500:].max() < 1e-3


@pytest.mark.long
def test_what_a_user_reported_stays_whatever_the_joint_does():
    def happens(k, plant, planner):
        jam(3)(k, plant, planner)
        if k == round(1.4 / DT):
            assert planner.findings
            planner.report(ftqp.Locked("panda_joint4"))

    planner, _ = led("velocity", happens, ticks=3000)
    assert planner.faults == {"panda_joint4": ftqp.Locked("panda_joint4")}
    assert planner.findings[0].withdrawn_at is None


def test_a_lock_at_rest_is_noticed_by_nobody(drive):
    planner, _ = standing(drive, lock(1), ticks=2000)
    assert planner.findings == () and planner.faults == {}


@pytest.mark.long
@pytest.mark.parametrize("drive", ["position", "torque"])
def test_known_friction_is_no_lock(drive):
    friction = [0.5] * 4 + [0.17] * 3
    planner, _ = standing(drive, ticks=3000, friction=friction)
    assert planner.findings == ()


@pytest.mark.long
def test_of_a_healthy_arm_at_rest_nothing_is_found(drive):
    planner, _ = standing(drive, ticks=4000)
    assert planner.findings == () and planner.diagnosis is not None


PERIOD, FAILS = 0.002, 900
BRAKE, STIFF = (0.9999, 0.9999, 0.001, 0.5, 2.0), (2 * PERIOD, 1.0)
"""How hard and how stiff MuJoCo's friction is, so that the brake neither creeps nor slips."""


def finished(robot, joint, kp, kv, file):
    """The planner, and how far the tip strayed, after a joint that stops on a circle."""
    file.write_text(robot.to_urdf())
    spec = mujoco.MjSpec.from_file(str(file))
    spec.option.timestep, spec.option.integrator = PERIOD, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.compiler.balanceinertia = True
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0
    for one in spec.joints:
        spec.add_actuator(name=one.name, target=one.name, trntype=mujoco.mjtTrn.mjTRN_JOINT).set_to_position(
            kp=kp, kv=kv
        )
        one.armature = 0.1
    model = spec.compile()
    data = mujoco.MjData(model)
    drive = ftqp.Drive(takes_velocity=False)
    planner = ftqp.Planner(robot, PERIOD, drive=drive, detector=ftqp.Detector())
    data.qpos[:] = data.ctrl[:] = robot.neutral
    mujoco.mj_forward(model, data)
    planner.reset(data.qpos)
    path = ftqp.paths.Circle(robot.pose(robot.neutral), radius=0.1, duration=5.0, axes=("y", "z"))
    way = path.sample(PERIOD * np.arange(2000))
    targets, strayed = ftqp.Targets(way.pose, way.twist, way.acceleration), 0.0
    for k in range(2000):
        if k == FAILS:
            model.dof_frictionloss[joint], model.dof_solimp[joint] = 500.0, BRAKE
            model.dof_solref[joint] = STIFF
            model.actuator_forcelimited[joint], model.actuator_forcerange[joint] = 1, 0.0
        data.ctrl[:] = planner.step(data.qpos, None, targets.at(k)).q
        mujoco.mj_step(model, data)
        strayed = max(strayed, float(np.linalg.norm(robot.pose(data.qpos)[:3, 3] - way.pose[k, :3, 3])))
    return planner, strayed


@pytest.mark.parametrize(
    ("name", "joint", "kp", "kv"),
    [("panda", 6, 3000.0, 150.0), ("panda", 4, 20000.0, 400.0), ("iiwa14", 6, 3000.0, 150.0)],
)
def test_the_joint_that_stops_is_named_and_none_that_follows_late_beside_it(tmp_path, name, joint, kp, kv):
    robot = ftqp.robots.load(name)
    planner, strayed = finished(robot, joint, kp, kv, tmp_path / "arm.urdf")
    assert list(planner.faults) == [robot.joints[joint]] and planner.stopped_because is None
    assert strayed < 0.03  # of which the path waits for some
