"""A loop that is late says how many periods have passed; the ticks that it missed are made up for."""

import numpy as np
import pytest
from late_loops import Count, episode

import ftqp

DT = 1e-3
COUNT = 400


def way(robot, q):
    path = ftqp.paths.Circle(robot.pose(q), radius=0.08, duration=2.0)
    motion = path.sample(np.arange(COUNT) * DT)
    return ftqp.Targets(motion.pose, motion.twist, motion.acceleration)


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


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
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


def test_one_period_is_what_a_step_without_ticks_takes(panda):
    gaps = [1] * 60
    said, silent = ridden(panda, gaps), ftqp.Planner(panda, DT)
    q = panda.neutral.copy()
    silent.reset(q)
    targets = way(panda, q)
    for k in range(1, 61):
        q = silent.step(q, None, targets.at(k)).q.copy()
        np.testing.assert_array_equal(q, said[k][0])


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
        planner = ftqp.Planner(panda, DT)
        planner.reset(panda.neutral)
        pose = panda.pose(panda.neutral)
        pose[0, 3] += 0.05
        return planner.step(panda.neutral, None, ftqp.Target(pose=pose), ticks=ticks).q.copy()

    np.testing.assert_array_equal(command(10**6), command(5))
    assert np.abs(command(5) - command(4)).max() > 0.0


@pytest.mark.parametrize("ticks", [0, -1, 1.5, None, "2"])
def test_ticks_that_are_none_are_a_sentence(panda, ticks):
    planner = ftqp.Planner(panda, DT)
    planner.reset(panda.neutral)
    with pytest.raises(ftqp.InputError, match=r"ticks is .* whole number >= 1"):
        planner.step(panda.neutral, None, ftqp.Target(pose=panda.pose(panda.neutral)), ticks=ticks)


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
