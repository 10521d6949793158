"""Arms that live between calls do bit by bit what planners stepped alone do, and forget all at a reset."""

import tracemalloc

import numpy as np
import pytest

import ftqp

DT, ARMS, TICKS = 0.004, 5, 5
EVEN = np.arange(ARMS) % 2 == 0


@pytest.fixture(scope="module")
def robot():
    return ftqp.robots.load("panda")


def made(robot, **given):
    return ftqp.Planner(robot, DT, **{"emergency": None, "task": ftqp.Task("position"), **given})


def starts(robot, count=ARMS):
    return robot.neutral + np.random.default_rng(1).uniform(-0.2, 0.2, (count, robot.nv))


def goals_near(arms, draw):
    return arms.poses()[:, :3, 3] + draw.uniform(-0.03, 0.03, (len(arms), 3))


@pytest.mark.parametrize(
    "given", [{}, {"level": "velocity"}, {"level": "acceleration", "drive": "torque"}, {"scheme": "rmp"}]
)
def test_each_arm_is_a_planner_stepped_alone_bit_by_bit(robot, given):
    arms, alone = ftqp.batch.Arms(made(robot, **given), ARMS), [made(robot, **given) for _ in range(ARMS)]
    arms.reset(None, starts(robot))
    states = [(q.copy(), np.zeros(robot.nv)) for q in starts(robot)]
    for planner, state in zip(alone, states, strict=True):
        planner.reset(*state)
    weak, draw = ftqp.Degraded(3, velocity=0.3, torque=0.5), np.random.default_rng(2)
    told = {
        20: (lambda arms: arms.report(EVEN, ftqp.Locked(1)), lambda one: one.report(ftqp.Locked(1)), EVEN),
        30: (lambda arms: arms.report(None, weak), lambda one: one.report(weak), ~EVEN | EVEN),
        50: (lambda arms: arms.withdraw(~EVEN, 3), lambda one: one.withdraw(3), ~EVEN),
        60: (lambda arms: arms.report(EVEN, ftqp.Locked("panda_joint2", mode="instant")),
             lambda one: one.report(ftqp.Locked("panda_joint2", mode="instant")), EVEN),
    }  # fmt: skip
    for k in range(80):
        goals, twist = goals_near(arms, draw), draw.uniform(-0.1, 0.1, (ARMS, 6))
        if k in told:
            together, one_by_one, who = told[k]
            together(arms)
            for arm in np.flatnonzero(who):
                one_by_one(alone[arm])
        arms.step(goals, TICKS, twist=twist)
        for arm, planner in enumerate(alone):
            q, v = states[arm]
            target = ftqp.Target(position=goals[arm], twist=twist[arm])
            for _ in range(TICKS):
                step = planner.step(q, v, target)
                q, v, _ = (part.copy() for part in step.reference)
            states[arm] = q, v
            assert q.tobytes() == arms.q[arm].tobytes() and v.tobytes() == arms.v[arm].tobytes(), (k, arm)
            assert list(ftqp.StepStatus)[arms.status[arm]] is step.status
            assert arms.position_error[arm] == step.position_error
            assert arms.faults(arm) == planner.faults


def test_an_arm_finds_a_joint_that_stands_as_a_planner_alone_finds_it(robot, caplog):
    arms, planner = ftqp.batch.Arms(made(robot), 2), made(robot)
    q, v, home = robot.neutral.copy(), np.zeros(7), robot.pose(robot.neutral)[:3, 3]
    planner.reset(q)
    for k in range(500):
        goal = home + 0.1 * np.array([np.sin(k / 60), 1.0 - np.cos(k / 60), 0.0])
        arms.q[0], arms.v[0] = q, v
        arms.step(np.array([goal, goal]))
        step = planner.step(q, v, ftqp.Target(position=goal))
        assert np.array_equal(arms.q_sent[0], step.q) and arms.faults(0) == planner.faults
        q, v = step.q.copy(), step.v.copy()
        q[3], v[3] = robot.neutral[3], 0.0
    assert list(arms.faults(0)) == ["panda_joint4"] and arms.found[0, 3] == 1 and not arms.found[1].any()
    assert arms.faults(1) == {}
    arms.withdraw(None, 3)
    planner.withdraw(3)
    for _ in range(20):
        arms.q[0], arms.v[0] = q, v
        arms.step(np.array([home, home]))
        step = planner.step(q, v, ftqp.Target(position=home))
        assert np.array_equal(arms.q_sent[0], step.q)
        q, v = step.q.copy(), step.v.copy()
    assert arms.faults(0) == planner.faults == {}


def test_threads_and_neighbours_change_nothing(robot):
    found = []
    for count, threads in ((100, 1), (100, 3), (40, 1)):
        arms = ftqp.batch.Arms(made(robot, level="velocity"), count, threads=threads)
        arms.reset(None, starts(robot, 100)[:count])
        arms.report(np.arange(count) % 3 == 0, ftqp.Locked(2))
        for k in range(10):
            goals = ftqp.batch.Arms.poses(arms)[:, :3, 3] + 0.01 * np.sin(np.arange(count) + k)[:, None]
            arms.step(goals, 10)
        found.append(arms.q[:40].tobytes())
    assert found[0] == found[1] == found[2]


def test_a_reset_leaves_nothing_of_the_last_episode(robot):
    def episode(arms):
        arms.reset(EVEN, starts(robot))
        draw, seen = np.random.default_rng(3), []
        for _ in range(30):
            arms.step(goals_near(arms, draw), TICKS)
            seen.append(arms.q[EVEN].copy())
        return np.array(seen)

    fresh, used = (ftqp.batch.Arms(made(robot, drive="torque"), ARMS) for _ in range(2))
    used.report(None, ftqp.Locked(3))
    for k in range(30):
        used.q[:] += 1e-3 * np.sin(k)  # an arm that does not do what it is told
        used.step(goals_near(used, np.random.default_rng(k)), TICKS)
    before = used.q[~EVEN].copy()
    fresh.reset(~EVEN, used.q, used.v)
    used_first = episode(used)
    assert used.faults(0) == {} and list(used.faults(1)) == ["panda_joint4"]
    assert (used.q[~EVEN] != before).any()
    fresh.reset()
    used.reset(~EVEN)
    goals = fresh.poses()[:, :3, 3].copy()
    fresh.reset(EVEN, starts(robot))
    assert np.array_equal(episode(fresh), used_first)
    assert goals.shape == (ARMS, 3)


def test_a_measured_place_is_taken_instead_of_the_command(robot):
    arms, planner = ftqp.batch.Arms(made(robot), 1), made(robot)
    arms.reset(None, robot.neutral)
    planner.reset(robot.neutral)
    q, target = robot.neutral.copy(), robot.pose(robot.neutral)[:3, 3] + (0.0, 0.05, 0.0)
    for _ in range(100):
        arms.q[0], arms.v[0] = q, 0.0
        arms.step(target[None])
        step = planner.step(q, np.zeros(7), ftqp.Target(position=target))
        assert np.array_equal(arms.q_sent[0], step.q) and np.array_equal(arms.v_sent[0], step.v)
        q = q + 0.9 * (step.q - q)
        assert np.array_equal(arms.q[0], step.reference[0])


def test_an_arm_whose_place_or_target_is_no_number_harms_no_other(robot):
    arms, other = ftqp.batch.Arms(made(robot), 2), ftqp.batch.Arms(made(robot), 1)
    goals = arms.poses()[:, :3, 3] + (0.0, 0.0, 0.02)
    for k in range(10):
        goals[1] = np.nan if k > 4 else goals[0]
        arms.step(goals)
        other.step(goals[:1])
    assert list(ftqp.StepStatus)[arms.status[1]] is ftqp.StepStatus.INVALID_INPUT
    assert np.array_equal(arms.q[0], other.q[0]) and np.isfinite(arms.q).all()


def test_arms_that_take_no_part_in_a_step_stay_as_they_are(robot):
    arms, other = ftqp.batch.Arms(made(robot), 2), ftqp.batch.Arms(made(robot), 1)
    goals = arms.poses()[:, :3, 3] + (0.0, 0.0, 0.02)
    for k in range(20):
        arms.step(goals, mask=np.array([True, k % 2 == 0]))
        if k % 2 == 0:
            other.step(goals[:1])
    assert np.array_equal(arms.q[1], other.q[0]) and not np.array_equal(arms.q[0], arms.q[1])


def test_a_step_allocates_nothing_and_rewrites_the_same_arrays(robot):
    arms = ftqp.batch.Arms(made(robot), 200, threads=1)
    goals, q, status = arms.poses()[:, :3, 3].copy(), arms.q, arms.status
    goals[:, 2] += 0.01
    arms.step(goals, 2)
    tracemalloc.start()
    try:
        for _ in range(5):
            arms.step(goals, 2)
        assert tracemalloc.get_traced_memory()[1] < 4000, "one array of 200 arms is 1,600 bytes a joint"
    finally:
        tracemalloc.stop()
    assert arms.q is q and arms.status is status and not np.array_equal(q[0], robot.neutral)


def test_arms_begin_with_the_faults_of_the_planner(robot):
    planner = made(robot)
    planner.report(ftqp.Locked(2))
    arms = ftqp.batch.Arms(planner, 2)
    arms.withdraw(np.array([True, False]), 2)
    assert arms.faults(0) == {} and list(arms.faults(1)) == ["panda_joint3"]
    arms.reset()
    assert list(arms.faults(0)) == ["panda_joint3"]
    goals = arms.poses()[:, :3, 3] + (0.0, 0.03, 0.0)
    arms.step(goals, 50)
    assert (arms.q[:, 2] == robot.neutral[2]).all() and (arms.q[:, 1] != robot.neutral[1]).all()


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        (lambda arms: arms.step(np.zeros((2, 3))), r"targets has shape \(2, 3\), expected poses"),
        (lambda arms: arms.step(np.zeros((5, 3)), 0), "ticks is 0, expected a whole number from 1"),
        (lambda arms: arms.step(np.zeros((5, 3)), twist=np.zeros(6)), r"twist has shape \(6,\)"),
        (lambda arms: arms.report([0, 1], ftqp.Locked(1)), r"mask is int64 of shape \(2,\), expected truth"),
        (lambda arms: arms.report(None, ftqp.FreeSwinging(1)), "FreeSwinging cannot be reported to Arms"),
        (lambda arms: arms.report(None, "joint 3"), "fault"),
        (lambda arms: arms.report(None, ftqp.Locked("elbow")), "panda_joint1"),
        (lambda arms: arms.withdraw(None, 9), "joint"),
        (lambda arms: arms.reset(None, np.zeros(6)), r"q has shape \(6,\), expected \(n, nv\) = \(5, 7\)"),
        (lambda arms: arms.reset(None, np.full(7, np.nan)), "q is not finite for some arm"),
        (lambda arms: arms.poses(np.zeros(7)), r"q has shape \(7,\), expected \(n, nv\) = \(5, 7\)"),
        (lambda arms: ftqp.batch.Arms(arms, 3), "planner is of type Arms, expected an ftqp.Planner"),
        (lambda arms: ftqp.batch.Arms(made(ftqp.robots.load("panda")), 0), "n is 0, expected a whole number"),
        (lambda arms: ftqp.batch.Arms(made(ftqp.robots.load("panda")), 10**8), "this machine has"),
    ],
)  # fmt: skip
def test_wrong_input_is_refused_in_one_sentence(robot, wrong, sentence):
    arms = ftqp.batch.Arms(made(robot), ARMS)
    before = arms.q.copy()
    with pytest.raises(ftqp.InputError, match=sentence):
        wrong(arms)
    assert np.array_equal(arms.q, before)


def test_positions_are_no_targets_of_a_task_that_turns(robot):
    arms = ftqp.batch.Arms(ftqp.Planner(robot, DT), 2)
    with pytest.raises(ftqp.InputError, match=r"expected poses, \(n, 4, 4\) = \(2, 4, 4\)$"):
        arms.step(np.zeros((2, 3)))
    arms.step(arms.poses(), 3)
    assert (arms.status == 0).all()
