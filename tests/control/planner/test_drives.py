"""What is told to drives, at ticks that come late too, and what a push from outside does."""

import numpy as np
import pytest
from late_loops import Count, episode
from tests.going import started, targets_along
from tests.ride import DT, START, circle, target_at

import ftqp

ROBOTS = ("panda", "puma560", "srs7")
LATE = 3
"""Samples are so many ticks late."""


@pytest.mark.parametrize(("mode", "late"), [("none", 0), ("instant", 0), ("ramp", LATE)])
@pytest.mark.parametrize("name", ROBOTS)
def test_on_an_arm_that_follows_exactly_all_drives_move_alike(name, mode, late, level):
    robot = ftqp.robots.load(name)
    q0 = START if name == "panda" else robot.neutral
    path = circle(robot, q0, 0.05, 0.6)
    targets = [target_at(path, k * DT) for k in range(500)]
    ways = []
    for kind in ("position", "velocity", *(("torque",) if robot.has_inertia else ())):
        drive = ftqp.Drive(kind=kind, latency=late * DT)
        planner = started(robot, DT, drive=drive, level=level, noise=ftqp.Noise(q=1e-5), at=q0)
        way = [q0] * (late + 1)
        for k, target in enumerate(targets):
            if k == 250 and mode != "none":
                planner.report(ftqp.Locked(2, mode=mode))
            way.append(planner.step(way[k], None, target).reference.q.copy())
        ways.append(np.array(way))
    assert np.abs(np.diff(ways[0], axis=0)).max() > 1e-5
    for way in ways[1:]:
        np.testing.assert_allclose(way, ways[0], rtol=0, atol=1e-9)


def test_measured_velocity_is_used_nowhere():
    robot = ftqp.robots.load("panda")
    targets, ends = targets_along(circle(robot, START), 300, DT), []
    for v in (None, np.zeros(7), np.full(7, 50.0)):
        planner, q = started(robot, DT, at=START), START
        for k in range(300):
            q = planner.step(q, v, targets.at(k)).q.copy()
        ends.append(q)
    assert (ends[0] == ends[1]).all() and (ends[0] == ends[2]).all()


COUNT = 400


def way(robot, q):
    return targets_along(ftqp.paths.Circle(robot.pose(q), radius=0.08, duration=2.0), COUNT, DT)


def ridden(robot, gaps, fault=None, **given):
    """Commands at the ticks of a loop with these gaps, by tick, of an arm that holds its last command."""
    planner = ftqp.Planner(robot, DT, **given)
    q = robot.neutral.copy()
    planner.reset(q)
    targets, found, k = way(robot, q), {}, 0
    for gap in gaps:
        k += gap
        if fault is not None and k >= 100 and not planner.faults:
            planner.report(fault)
        step = planner.step(q, None, targets.at(k), ticks=gap)
        q = step.q.copy()
        found[k] = q, step.status
    return found


@pytest.mark.parametrize("fault", [None, ftqp.Degraded(1, velocity=0.6)])
def test_a_late_command_is_where_it_would_be_had_the_loop_been_on_time(panda, level, fault):
    gaps = [1] * 99 + [1, 4, 1, 2, 1, 1, 5, 1, 3] * 12
    late, on_time = (
        ridden(panda, gaps, fault, level=level),
        ridden(panda, [1] * sum(gaps), fault, level=level),
    )
    assert {status for _, status in late.values()} <= {status for _, status in on_time.values()}
    worst = max(np.abs(q - on_time[k][0]).max() for k, (q, _) in late.items())
    assert worst < 2e-4  # what an arm that held its command does to the feedback


def test_a_joint_that_locks_in_a_late_loop_is_borne_as_on_time(panda):
    gaps = [1] * 99 + [1, 4, 1, 2, 1, 1, 5, 1, 3] * 12
    late, on_time = ridden(panda, gaps, ftqp.Locked(3)), ridden(panda, [1] * sum(gaps), ftqp.Locked(3))
    assert {status for _, status in late.values()} <= {status for _, status in on_time.values()}
    end, before = (late[max(late) - back][0] for back in (0, 4))
    assert end[3] == before[3]


def test_no_gap_breaks_a_limit():
    count = Count()
    for seed in range(40):
        episode(seed, count)
    assert count.broken == [] and count.steps > 500 and count.refused == 0


def test_a_loop_that_is_always_late_is_not_taken_for_a_lost_sensor(panda):
    found = ridden(panda, [4] * 99)
    assert {status for _, status in found.values()} == {ftqp.StepStatus.OK}


def test_a_longer_gap_counts_as_five_periods(panda):
    def command(ticks):
        planner = started(panda, DT)
        pose = panda.pose(panda.neutral)
        pose[0, 3] += 0.05
        return planner.step(panda.neutral, None, ftqp.Target(pose=pose), ticks=ticks).q.copy()

    np.testing.assert_array_equal(command(10**6), command(5))
    assert np.abs(command(5) - command(4)).max() > 0.0


def test_a_detector_finds_nothing_in_a_loop_that_is_late(panda):
    planner = ftqp.Planner(panda, DT, detector=ftqp.Detector())
    q = panda.neutral.copy()
    planner.reset(q)
    targets, k, rng = way(panda, q), 0, np.random.default_rng(3)
    while k < COUNT - 6:
        gap = int(rng.choice([1, 1, 1, 1, 3, 5]))
        k += gap
        step = planner.step(q, None, targets.at(k), tau=None, ticks=gap)
        q = step.q.copy()
    assert planner.faults == {}


TWO_MS = 0.002
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
    pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    planner = ftqp.Planner(PANDA, TWO_MS, drive=drive, noise=ftqp.Noise(q=1e-5), detector=detector)
    plant = ftqp.MujocoPlant(PANDA, TWO_MS, ftqp.JointServo(PANDA, drive))
    plant.reset(PANDA.neutral, np.zeros(7))
    planner.reset(PANDA.neutral)
    rng, named, felt = np.random.default_rng(0), {}, []
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.05, duration=4.0)
    targets = targets_along(path, round(seconds / TWO_MS), TWO_MS)
    for k in range(len(targets)):
        if k in (400, 550):
            plant.push(force if k == 400 else np.zeros(3))
        if k == 500 and locks is not None:
            plant.fail(ftqp.Locked(locks))
            planner.report(ftqp.Locked(locks))
        step = planner.step(plant.q + 1e-5 * rng.standard_normal(7), None, targets.at(k))
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
    assert drive == "position" or (felt and min(felt) < 430)
    assert not planner.findings and planner.stopped_because is None


def test_a_push_is_over_once_a_failure_is_known():
    """It may have been the failure; while it went on for good nothing was learned any more."""
    planner, named, _ = pushed("torque", (0.0, 30.0, 0.0), locks=3)
    assert 490 in named
    assert max(named) <= 501 and planner.touch is None
