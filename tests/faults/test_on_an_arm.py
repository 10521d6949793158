"""A detector that is told of nothing, beside a planner that drives an arm in physics and detects nothing."""

import numpy as np
import pytest

import ftqp
from ftqp.sim.plants.troubled_plant import Jammed, Weakened

DT, SIGMA = 1e-3, 1e-4
AT, WATCHED = 1.0, 0.3
DRIVES = {"position": ftqp.Drive(bandwidth=94.0), "torque": ftqp.Drive(kind="torque")}


def motion(robot, drive, seed, ticks, happens=None, detector=None, standing=0.0):
    """The log of a circle; ``happens`` is done to the arm at AT, and a detector looks on until it is sure."""
    noise = ftqp.Noise(q=SIGMA)
    planner = ftqp.Planner(robot, DT, drive=DRIVES[drive], noise=noise, detector=False)
    plant = ftqp.MujocoPlant(robot, DT, ftqp.JointServo(robot, drive), substeps=2)
    generator = np.random.default_rng(seed)
    axes = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.12, duration=2.5, axes=(axes[0], axes[1]))
    t = np.minimum(DT * np.arange(ticks), path.duration)
    sample = path.sample(t)
    targets = ftqp.Targets(sample.pose, sample.twist, sample.acceleration)
    planner.reset(robot.neutral)
    plant.reset(robot.neutral, np.zeros(robot.nv))
    rows = {name: np.zeros((ticks, robot.nv)) for name in ("q", "q_ref", "v_ref", "a_ref", "effort")}
    for k in range(ticks):
        if happens is not None and k == round(AT / DT):
            happens(plant)
        q = plant.q + SIGMA * generator.standard_normal(robot.nv)
        step = planner.step(q, None, targets.at(k))
        rows["q"][k], rows["effort"][k] = q, step.tau
        rows["q_ref"][k], rows["v_ref"][k], rows["a_ref"][k] = step.reference
        if detector is not None and detector.update(q, None, None, step).isolated:
            break
        plant.advance(step)
    return rows


@pytest.fixture(params=list(DRIVES))
def arm(request, robot):
    """The robot, its drive, and a detector of it."""
    drive = request.param
    return robot, drive, ftqp.Detector(robot=robot, dt=DT, drive=DRIVES[drive], noise=ftqp.Noise(q=SIGMA))


@pytest.mark.slow
def test_healthy_motion_raises_no_alarm(arm):
    robot, drive, detector = arm
    motion(robot, drive, 7, 3000, detector=detector)
    assert not detector.diagnosis.isolated and not detector.diagnosis.watching


NOT_YET = {("position", "free-3"), ("torque", "free-1"), ("torque", "free-3")}
NOT_YET_BECAUSE = "A heavy joint without a motor is called runaway before its evidence suffices."


@pytest.mark.slow
@pytest.mark.parametrize("joint", [1, 3])
@pytest.mark.parametrize(
    ("kind", "happens"),
    [
        ("locked", lambda plant, j: plant.fail(ftqp.Locked(j))),
        ("locked", lambda plant, j: plant.suffer(Jammed(j))),
        ("free_swinging", lambda plant, j: plant.fail(ftqp.FreeSwinging(j))),
    ],
    ids=["brake", "brake and motor", "free"],
)
def test_joint_and_kind_are_found_soon(arm, kind, happens, joint, request):
    robot, drive, detector = arm
    if (drive, request.node.callspec.id.split("-", 1)[1]) in NOT_YET:
        request.applymarker(pytest.mark.xfail(strict=True, reason=NOT_YET_BECAUSE))
    rows = motion(robot, drive, 5, 1500, lambda plant: happens(plant, joint), detector)
    assert abs(rows["v_ref"][1000, joint]) > 0.03, "the joint moves when it fails"
    findings = detector.diagnosis.isolated
    assert set(findings) == {robot.joints[joint]}
    found = findings[robot.joints[joint]]
    assert kind in found.kinds and AT <= found.onset < found.detected_at < AT + WATCHED


@pytest.mark.long
@pytest.mark.parametrize("by", [0.2, 0.5])
def test_torque_that_is_weak_and_followed_is_no_finding(robot, by):
    detector = ftqp.Detector(robot=robot, dt=DT, drive="torque", noise=ftqp.Noise(q=SIGMA))
    motion(robot, "torque", 5, 1500, lambda plant: plant.suffer(Weakened(3, 1.0 - by)), detector)
    assert not detector.diagnosis.isolated
