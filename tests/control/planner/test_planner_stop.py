"""A stop is called for a reason, brakes within the limits, and latches until reset."""

import numpy as np
import pytest

import ftqp

DT = 2e-3
STOPPING, STOPPED = ftqp.StepStatus.STOPPING, ftqp.StepStatus.STOPPED


def running_away(home, speed=1.0, start=0.2):
    """A target that leaves the arm behind: the error rises on every tick."""
    target = ftqp.Target(pose=home)

    def at(k):
        target.position[:] = home[:3, 3] + [0.0, 0.0, start + speed * DT * k]
        return target

    return at


@pytest.mark.parametrize("samples", [1, 7])
def test_stop_comes_after_that_many_rising_samples(panda, home, level, follow, samples):
    stop = ftqp.EmergencyStop(position=0.05, samples=samples)
    planner = ftqp.Planner(panda, DT, level=level, emergency=stop)
    statuses = [s.status for s in follow(planner, running_away(home), samples + 3)]
    first = next(k for k, s in enumerate(statuses) if s in (STOPPING, STOPPED))
    assert first == samples  # sample 0 has nothing to rise from


def test_error_below_its_threshold_or_falling_does_not_stop(panda, home, level, follow):
    target = ftqp.Target(pose=home)
    target.position[2] += 0.1  # beyond the threshold, but falling
    statuses = {s.status for s in follow(ftqp.Planner(panda, DT, level=level), target, 40)}
    assert not statuses & {STOPPING, STOPPED}
    creeping = running_away(home, speed=0.01, start=0.0)
    planner = ftqp.Planner(panda, DT, level=level, task=ftqp.Task(kp=0.0, kv=0.0))
    assert not {s.status for s in follow(planner, creeping, 500)} & {STOPPING, STOPPED}


def test_rotation_error_stops_too(panda, home, level, follow):
    target = ftqp.Target(pose=home)
    rotation = home[:3, :3].copy()

    def turning(k):
        c, s = np.cos(0.5 + 0.01 * k), np.sin(0.5 + 0.01 * k)
        target.pose[:3, :3] = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ rotation
        return target

    assert [s.status for s in follow(ftqp.Planner(panda, DT, level=level), turning, 10)][-1] in (
        STOPPING,
        STOPPED,
    )


@pytest.mark.parametrize("backend", ["active_set", "daqp"])
def test_stop_brakes_every_joint_within_its_limits_and_latches_until_reset(
    panda, home, level, follow, backend
):
    path = ftqp.paths.Circle(home, 0.15, duration=1.2, axes=("y", "z"))
    sample = path.sample(np.arange(600) * DT)
    target = ftqp.Target(pose=home)

    def at(k):
        target.pose[:], target.twist[:] = sample.pose[k], sample.twist[k]
        if 250 <= k < 260:
            target.position[2] += 0.3 + 0.01 * k
        return target

    planner = ftqp.Planner(panda, DT, level=level, backend=backend)
    speed, seen, moving = np.zeros(7), [], None
    limits = panda.limits
    for step in follow(planner, at, 600):
        seen.append(step.status)
        if step.status in (STOPPING, STOPPED):
            moving = np.abs(speed).max() if moving is None else moving
            assert np.all(np.abs(step.a) <= limits.a_max * (1.0 + 1e-9))
            assert np.all(np.abs(step.tau) <= limits.tau_max + 1e-6)
            assert np.all(np.abs(step.v) <= np.abs(speed) + 1e-12)
            assert np.all(step.q > limits.q_min) and np.all(step.q < limits.q_max)
            assert step.scale == 0.0 and step.certificate is None
        speed = step.v.copy()
    first = seen.index(STOPPING)
    assert 250 < first < 260 and moving > 0.2
    rest = seen.index(STOPPED)
    assert set(seen[first:rest]) == {STOPPING} and set(seen[rest:]) == {STOPPED}
    assert (rest - first) * DT < 0.5
    assert np.abs(speed).max() < 1e-9
    planner.reset(panda.neutral)
    assert planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home)).status is ftqp.StepStatus.OK


def test_stopped_arm_still_takes_reports_and_bad_input(panda, home, follow):
    planner = ftqp.Planner(panda, DT)
    *_, last = follow(planner, running_away(home), 100)
    assert last.status is STOPPED
    planner.report(ftqp.Locked(1))
    step = planner.step(np.full(7, np.nan), np.zeros(7), ftqp.Target(pose=home))
    assert step.status is STOPPED and np.isfinite(step.q).all()
    assert planner.step(step.q.copy(), step.v.copy(), ftqp.Target(pose=home)).status is STOPPED


def test_error_that_only_noise_lifts_does_not_stop(panda, home, follow):
    """Three rising samples in a row, not three in all."""
    target = ftqp.Target(pose=home)

    def jumping(k):
        target.position[:] = home[:3, 3] + [0.0, 0.0, 0.2 + 0.05 * (k % 3 != 0)]
        return target

    planner = ftqp.Planner(panda, DT, emergency=ftqp.EmergencyStop(position=0.05, samples=3))
    assert not {s.status for s in follow(planner, jumping, 15)} & {STOPPING, STOPPED}
