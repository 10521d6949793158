"""A detector beside a planner that drives an arm in physics, and is told of nothing."""

import numpy as np
import pytest

import ftqp
from ftqp.sim.plants.hidden_faults import Jammed, Runaway, Weakened

DT, SIGMA = 1e-3, 1e-4
AT, WATCHED = 1.0, 0.1
DRIVES = {"position": ftqp.Drive(bandwidth=94.0), "torque": ftqp.Drive(kind="torque")}


def motion(robot, drive, seed, ticks, happens=None, detector=None, standing=0.0):
    """The log of a circle; ``happens`` is done to the arm at AT, and a detector looks on until it is sure."""
    planner = ftqp.Planner(robot, DT, drive=DRIVES[drive], noise=ftqp.Noise(q=SIGMA))
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
    if drive == "position":
        del rows["effort"]
    return rows


@pytest.fixture(scope="module", params=list(DRIVES))
def arm(request, robot):
    """The robot, its drive, and a detector that was calibrated on its healthy motion."""
    drive = request.param
    blank = ftqp.Detector(robot=robot, dt=DT, drive=drive, noise=ftqp.Noise(q=SIGMA))
    logs = [ftqp.MotionLog(**motion(robot, drive, seed, 3000)) for seed in range(101, 118)]
    return robot, drive, blank.calibrate(logs, 1.0, extrapolate=True)


@pytest.mark.slow
def test_healthy_motion_that_was_not_calibrated_on_raises_no_alarm(arm):
    robot, drive, detector = arm
    detector.reset()
    motion(robot, drive, 7, 3000, detector=detector)
    assert not detector.diagnosis.isolated and not detector.diagnosis.watching


@pytest.mark.slow
@pytest.mark.parametrize("joint", [1, 3])
@pytest.mark.parametrize(
    ("kind", "happens"),
    [
        ("locked", lambda plant, j: plant.fail(ftqp.Locked(j))),
        ("locked", lambda plant, j: plant.suffer(Jammed(j))),
        ("free_swinging", lambda plant, j: plant.fail(ftqp.FreeSwinging(j))),
        ("degraded", lambda plant, j: plant.suffer(Weakened(j, 0.5))),
        ("runaway", lambda plant, j: plant.suffer(Runaway(j, 1))),
    ],
    ids=["brake", "brake and motor", "free", "degraded", "runaway"],
)
def test_joint_and_kind_are_found_soon(arm, kind, happens, joint):
    robot, drive, detector = arm
    detector.reset()
    rows = motion(robot, drive, 5, 1200, lambda plant: happens(plant, joint), detector)
    assert abs(rows["v_ref"][1000, joint]) > 0.03, "the joint moves when it fails"
    findings = detector.diagnosis.isolated
    if kind == "degraded" and drive == "position":  # its servo makes up for it, and its demand is not told
        assert all(name == robot.joints[joint] and kind in one.kinds for name, one in findings.items())
        return
    assert set(findings) == {robot.joints[joint]}
    found = findings[robot.joints[joint]]
    assert kind in found.kinds and AT < found.detected_at < AT + WATCHED
    assert abs(found.onset - AT) < 0.03
    if kind == "degraded":
        assert found.share == pytest.approx(0.5, abs=0.2)
