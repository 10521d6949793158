"""Something pushes the tip of an arm: its force is named, and no joint is taken for failed."""

import numpy as np
import pytest

import ftqp

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
DT = 0.002
PANDA = ftqp.robots.load("panda")


def pushed(drive, force, detector=None, seconds=1.4, locks=None):
    """A Panda that holds its place is pushed from 0.8 to 1.1 s: the planner, and the forces it named.

    Args:
        drive: What it takes.
        force: That pushes [N].
        detector: Of the planner.
        seconds: How long.
        locks: The joint that locks at 1 s, which is told.
    """
    planner = ftqp.Planner(PANDA, DT, drive=drive, noise=ftqp.Noise(q=1e-5), detector=detector)
    plant = ftqp.MujocoPlant(PANDA, DT, ftqp.JointServo(PANDA, drive))
    plant.reset(PANDA.neutral, np.zeros(7))
    planner.reset(PANDA.neutral)
    rng, named, felt = np.random.default_rng(0), {}, []
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.05, duration=4.0)
    way = path.sample(DT * np.arange(round(seconds / DT)))
    target = ftqp.Target(pose=way.pose[0])
    for k in range(round(seconds / DT)):
        if k in (400, 550):
            plant.push(force if k == 400 else np.zeros(3))
        if k == 500 and locks is not None:
            plant.fail(ftqp.Locked(locks))
            planner.report(ftqp.Locked(locks))
        target.pose[:], target.twist[:] = way.pose[k], way.twist[k]
        target.acceleration[:] = way.acceleration[k]
        step = planner.step(plant.q + 1e-5 * rng.standard_normal(7), None, target)
        if planner.touch is not None:
            named[k] = planner.touch
        if planner.diagnosis is not None and planner.diagnosis.touched:
            felt.append(k)
        plant.advance(step)
    return planner, named, felt


@pytest.mark.parametrize(("force", "over"), [((0.0, 30.0, 0.0), 640), ((10.0, 0.0, -25.0), 700)])
def test_a_torque_arm_names_the_force_while_it_pushes(force, over):
    """A push downwards may as well be a load for an arm that has hardly moved, and lasts longer."""
    planner, named, _ = pushed("torque", force)
    assert min(named) < 430 and max(named) < over
    np.testing.assert_allclose(named[500], force, atol=0.35 * np.linalg.norm(force))
    assert planner.stopped_because is None


@pytest.mark.parametrize("drive", ["torque", "position"])
def test_a_detector_finds_no_joint(drive):
    planner, _, felt = pushed(drive, (0.0, 10.0, -50.0), ftqp.Detector())
    assert felt and min(felt) < 430
    assert not planner.findings and planner.stopped_because is None


def test_a_push_is_over_once_a_failure_is_known():
    """It may have been the failure; while it went on for good nothing was learned any more."""
    planner, named, _ = pushed("torque", (0.0, 30.0, 0.0), locks=3)
    assert 490 in named
    assert max(named) <= 501 and planner.touch is None


def test_a_push_that_is_none_is_refused():
    plant = ftqp.MujocoPlant(PANDA, DT)
    for force in ((1.0, 2.0), (np.nan, 0.0, 0.0), "hard"):
        with pytest.raises(ftqp.InputError, match="force"):
            plant.push(force)
