"""A detector that nobody calibrated beside MuJoCo's own position servos, with a brake that closes."""

import mujoco
import numpy as np
import pytest

import ftqp

DT, FAILS = 0.002, 900
BRAKE, STIFF = (0.9999, 0.9999, 0.001, 0.5, 2.0), (2 * DT, 1.0)
"""How hard and how stiff MuJoCo's friction is, so that the brake neither creeps nor slips."""


def finished(robot, joint, kp, kv, file):
    """The planner, and how far the tip strayed, after a joint that stops on a circle."""
    file.write_text(robot.to_urdf())
    spec = mujoco.MjSpec.from_file(str(file))
    spec.option.timestep, spec.option.integrator = DT, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
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
    planner = ftqp.Planner(robot, DT, drive=drive, detector=ftqp.Detector())
    data.qpos[:] = data.ctrl[:] = robot.neutral
    mujoco.mj_forward(model, data)
    planner.reset(data.qpos)
    path = ftqp.paths.Circle(robot.pose(robot.neutral), radius=0.1, duration=5.0, axes=("y", "z"))
    way = path.sample(DT * np.arange(2000))
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


@pytest.mark.parametrize(("joint", "kp", "kv"), [(6, 3000.0, 150.0), (4, 20000.0, 400.0)])
def test_the_joint_that_stops_is_named_and_no_other(panda, tmp_path, joint, kp, kv):
    planner, strayed = finished(panda, joint, kp, kv, tmp_path / "arm.urdf")
    assert list(planner.faults) == [panda.joints[joint]] and planner.stopped_because is None
    assert strayed < 0.02


def test_joint_that_follows_late_beside_one_that_stands_has_not_lost_its_torque(tmp_path):
    robot = ftqp.robots.load("iiwa14")
    planner, strayed = finished(robot, 6, 3000.0, 150.0, tmp_path / "arm.urdf")
    assert list(planner.faults) == [robot.joints[6]] and planner.stopped_because is None
    assert strayed < 0.02
