"""Other ways to a pose where the straight one ends: they arrive, and whatever comes between is borne."""

import numpy as np
import pytest
from tests.going import closed_loop, go, planner_at, within_limits

import ftqp

PANDA = ftqp.robots.load("panda")
STATUS = ftqp.GoToStatus


def case(k):
    """Where a Panda is, a pose with a posture, and the joint that is locked there (see benchmarks/peers)."""
    generator = np.random.default_rng([7, k])
    here, there = (generator.uniform(PANDA.limits.q_min, PANDA.limits.q_max) for _ in range(2))
    return here, PANDA.pose(there), int(generator.integers(7))


HERE, GOAL, JOINT = case(3)


def begun(level="acceleration", **given):
    planner = planner_at(HERE, level)
    planner.report(ftqp.Locked(JOINT, mode="instant"))
    return ftqp.GoTo(planner, pose=GOAL, **given)


def test_goal_that_the_straight_way_misses_is_reached_by_another_posture(level):
    goto = begun(level)
    steps = go(goto, HERE, longest=20.0)
    assert goto.status is STATUS.REACHED and goto.sentence == goto.status.value
    healthy = np.delete(np.arange(7), JOINT)
    q = np.array([step.q for step in steps])[:, healthy]
    limits = PANDA.limits
    assert (q >= limits.q_min[healthy] - 1e-9).all() and (q <= limits.q_max[healthy] + 1e-9).all()
    assert all(step.q[JOINT] == HERE[JOINT] for step in steps)
    assert np.abs(PANDA.pose(steps[-1].q) - GOAL).max() < 1e-3
    assert not {step.status for step in steps} & {ftqp.StepStatus.STOPPING, ftqp.StepStatus.FALLBACK}


@pytest.mark.parametrize(
    ("away", "said"),
    [
        (0.5, "no posture was found in 600 starts"),
        (2.0, "the pose is 2.31 m from panda_joint1, and the arm is 1.09 m long, stretched"),
    ],
)
def test_goal_outside_the_workspace_says_how_much_was_looked_at(away, said):
    goal = PANDA.pose(PANDA.neutral)
    goal[:3, 3] += [away, 0.0, 0.0]
    goto = ftqp.GoTo(planner_at(PANDA.neutral), pose=goal)
    goto.step(PANDA.neutral)
    assert goto.note.endswith(said) == (away == 2.0)
    notes = set()
    go(goto, PANDA.neutral, longest=30.0, each=lambda k: notes.add(goto.note))
    assert sum("is looked for" in note for note in notes) == (away == 0.5)
    assert goto.status is STATUS.UNREACHABLE
    assert goto.sentence.endswith(said)


def test_goal_twenty_arms_away_is_refused_before_anything_moves():
    goal = PANDA.pose(PANDA.neutral)
    goal[:3, 3] *= 1000.0
    with pytest.raises(ftqp.InputError, match=r"the pose is .* m from the base .* looks like millimetres"):
        ftqp.GoTo(planner_at(PANDA.neutral), pose=goal)


def test_all_joints_locked_is_unreachable_and_stands():
    planner = planner_at(PANDA.neutral)
    for joint in PANDA.joints:
        planner.report(ftqp.Locked(joint, mode="instant"))
    goal = PANDA.pose(PANDA.neutral)
    goal[2, 3] += 0.1
    goto = ftqp.GoTo(planner, pose=goal)
    steps = go(goto, PANDA.neutral)
    assert goto.status is STATUS.UNREACHABLE and np.array_equal(steps[-1].q, PANDA.neutral)


@pytest.mark.parametrize(
    "when",
    ["another one is looked for", pytest.param("the joints go to another posture", marks=pytest.mark.slow)],
)
def test_second_failure_while_thinking_or_on_the_way_begins_anew(when):
    goto, told = begun(), []

    def each(k):
        if not told and when in goto.note:
            other = (JOINT + 2) % 7
            goto.planner.report(ftqp.Locked(other))
            told.append(k)

    steps = go(goto, HERE, longest=30.0, each=each)
    assert told and goto.done
    assert goto.status in (STATUS.REACHED, STATUS.UNREACHABLE)
    assert (np.abs(steps[-1].v) < 1e-3 * PANDA.limits.v_max).all()
    if goto.status is STATUS.REACHED:
        assert np.abs(PANDA.pose(steps[-1].q) - GOAL).max() < 5e-3


def test_ways_are_looked_for_where_a_joint_that_brakes_has_come_to_rest():
    goal = PANDA.pose(PANDA.neutral).copy()
    goal[:3, 3] += [0.15, 0.35, -0.3]
    goto, searches = ftqp.GoTo(planner_at(PANDA.neutral), pose=goal), []

    def each(k):
        if k == 75:
            goto.planner.report(ftqp.Locked(4))
        searched = goto._joints.searched
        if searched is not None and searched not in searches:
            searches.append(searched)

    go(goto, PANDA.neutral, longest=15.0, each=each)
    assert goto.status is STATUS.REACHED and 1 <= len(searches) <= 4


@pytest.mark.slow
def test_repair_on_the_way_begins_anew_with_all_joints():
    goto, told = begun(), []

    def each(k):
        if not told and "the joints go" in goto.note:
            goto.planner.withdraw(JOINT)
            told.append(k)

    go(goto, HERE, longest=30.0, each=each)
    assert told and goto.status is STATUS.REACHED


@pytest.mark.slow
def test_another_goal_meanwhile_is_gone_to_and_the_first_may_be_taken_up_again():
    goto = begun()
    steps = go(goto, HERE, longest=20.0)[:0]
    planner = planner_at(HERE)
    planner.report(ftqp.Locked(JOINT, mode="instant"))
    first, q, v = ftqp.GoTo(planner, pose=GOAL), HERE, np.zeros(7)
    while "looked for" not in first.note:
        step = first.step(q, v)
        q, v = step.q.copy(), step.v.copy()
    near = PANDA.pose(q)
    second = ftqp.GoTo(planner, pose=near)
    steps = go(second, q, v)
    assert second.status is STATUS.REACHED
    go(first, steps[-1].q, steps[-1].v, longest=20.0)
    assert first.status is STATUS.REACHED


def test_stop_on_the_way_halts_and_resume_goes_on():
    goto, told = begun(), []

    def each(k):
        if not told and "the joints go" in goto.note:
            goto.planner.stop()
            told.append(k)

    steps = go(goto, HERE, longest=30.0, each=each)
    assert goto.status is STATUS.HALTED and goto.done
    goto.planner.resume()
    go(goto, steps[-1].q, steps[-1].v, longest=30.0)
    assert goto.status is STATUS.REACHED


def test_way_leads_round_a_wall_that_the_straight_way_cannot_pass():
    """No body is nearer to another one than is kept, and ``straight`` stays before the wall."""
    scene = ftqp.Scene()
    scene.add("wall", ftqp.Box(size=(0.5, 0.04, 0.6), place=(0.55, 0.0, 0.3)))
    here, there = (PANDA.pose(PANDA.neutral).copy() for _ in range(2))
    here[:3, 3], there[:3, 3] = (0.45, -0.3, 0.4), (0.45, 0.3, 0.4)
    start = ftqp.postures(PANDA, here, near=PANDA.neutral)[0].q
    for straight in (True, False):
        planner = ftqp.Planner(PANDA, 4e-3, scene=scene)
        planner.reset(start)
        goto = ftqp.GoTo(planner, pose=there, straight=straight)
        steps = go(goto, start, longest=20.0)
        assert goto.status is (STATUS.UNREACHABLE if straight else STATUS.REACHED)
        assert (goto.way is None) is straight
        rows = np.array([step.q for step in steps])
        apart = np.min(list(planner.distances(rows).values()), axis=0)
        first = min(d.min() for d in planner.distances(start[None]).values())
        assert apart.min() > min(first, 0.02) - 2e-3
    assert np.abs(PANDA.pose(steps[-1].q) - there).max() < 1e-3
    assert len(goto.way) > 2 and np.abs(PANDA.pose(goto.way[-1]) - there).max() < 5e-3
    assert np.abs(rows - goto.way[0]).max(axis=1).min() < 1e-3


def test_postures_that_come_too_near_to_a_scene_are_last_and_not_held():
    goal = PANDA.pose(PANDA.neutral)
    goal[:3, 3] += [0.05, 0.1, 0.1]
    free = ftqp.postures(PANDA, goal, near=PANDA.neutral)
    elbow = PANDA.pose(free[0].q, "panda_joint4")[:3, 3]
    scene = ftqp.Scene()
    scene.add("ball", ftqp.Sphere(radius=0.08, place=elbow))
    planner = ftqp.Planner(PANDA, 4e-3, scene=scene, clearance=ftqp.Clearance(self_pairs=False))
    found = ftqp.postures(PANDA, goal, near=PANDA.neutral, clear_of=planner)
    held = [one.is_held for one in found]
    assert held == sorted(held, reverse=True) and True in held and False in held
    for one in found:
        apart = min(float(d.min()) for d in planner.distances(one.q[None]).values())
        assert one.clearance == pytest.approx(apart, abs=1e-12)
        assert one.is_held == (apart > 0.019 and one.effort <= 0.98)


def test_ways_out_that_are_asked_for_at_the_last_moment_stop_before_the_limit():
    """A joint at full speed that has just room to brake."""
    planner = planner_at(PANDA.neutral)
    q, v = PANDA.neutral.copy(), np.zeros(7)
    goto = ftqp.GoTo(planner, q=np.where(np.arange(7) == 0, PANDA.limits.q_max - 1e-3, PANDA.neutral))
    *_, step = closed_loop(goto, None, 300, q, v)
    q, v = step.q.copy(), step.v.copy()
    assert v[0] > 1.0
    planner.report(ftqp.Locked(3, mode="instant"))
    ways = {way.kind: way for way in planner.ways_out()}
    assert ways["stop"].clear
    assert (ways["stop"].places[-1] <= PANDA.limits.q_max).all()
    assert within_limits(go(ftqp.GoTo(planner, way=ways["stop"]), q, v))


def test_tip_that_is_to_be_slow_goes_on_slowly_and_straight():
    """A slow reference is no arm that comes no nearer: no joint may swing to another posture for it."""
    start = PANDA.neutral
    goal = PANDA.pose(start).copy()
    goal[1, 3] -= 0.3
    goto = ftqp.GoTo(planner_at(start), pose=goal, limits=ftqp.TipLimits(speed=4e-3))
    steps = go(goto, start, longest=2.5)
    assert goto.note == "the end effector goes straight"
    moved = PANDA.pose(steps[-1].q)[:3, 3] - PANDA.pose(start)[:3, 3]
    assert np.linalg.norm(moved) < 0.011 and np.abs(moved[[0, 2]]).max() < 1e-5


def test_arm_that_creeps_on_takes_the_other_way_where_that_is_sooner():
    """Joint 5 is locked after 0.2 s; going straight, it takes 13 s, the rest at 1 to 4 % a second."""
    start = np.array([-1.12697, 0.532292, -1.181144, -1.308069, 1.205326, 1.35239, 0.027195])
    goal = np.array(
        [[-0.5984999265, -0.3445334916, 0.7232527298, 0.1801212187],
         [0.7706119857, -0.4943693186, 0.4021891837, 0.6394179080],
         [0.2189863134, 0.7980574227, 0.5613816390, 0.9834504427], [0.0, 0.0, 0.0, 1.0]]
    )  # fmt: skip
    goto = ftqp.GoTo(planner_at(start), pose=goal)

    def fail(k):
        if k == 50:
            goto.planner.report(ftqp.Locked(4))

    steps = go(goto, start, longest=6.0, each=fail)
    assert goto.status is STATUS.REACHED and len(steps) * 4e-3 < 5.0


@pytest.mark.parametrize("locked", [(2, 4), (1, 5), (0, 3), (4, 6)])
def test_beside_two_locks_postures_are_asked_for_though_fewer_joints_work_than_there_are_rows(locked):
    here, generator = PANDA.neutral, np.random.default_rng([3, *locked])
    there = here + generator.uniform(-0.4, 0.4, 7)
    there[list(locked)] = here[list(locked)]
    goal = PANDA.pose(np.clip(there, PANDA.limits.q_min + 0.05, PANDA.limits.q_max - 0.05))
    faults = [ftqp.Locked(joint, mode="instant") for joint in locked]
    assert ftqp.postures(PANDA, goal, faults=faults, near=here)
    planner = planner_at(here)
    for fault in faults:
        planner.report(fault)
    goto = ftqp.GoTo(planner, pose=goal)
    go(goto, here, longest=20.0)
    assert "was looked for" not in goto.sentence
    assert goto.status is STATUS.REACHED, goto.sentence
