"""Targets that jump and twists of an operator: limits, freshness, the leash, and what is said."""

import numpy as np
import pytest

import ftqp

PANDA = ftqp.robots.load("panda")
HOME = PANDA.neutral
START = PANDA.pose(HOME)
LIMITS = ftqp.TipLimits(speed=0.3, acceleration=1.5, turn=1.0, turn_acceleration=5.0)
DT = 2e-3
REST = np.zeros(6)


def follower_of(level="acceleration", dead_man=0.2, **settings):
    follower = ftqp.TargetFollower(
        ftqp.Planner(PANDA, DT, level=level, **settings), LIMITS, dead_man=dead_man
    )
    follower.reset(HOME)
    return follower


def run(follower, target, time, q=HOME, v=None):
    """Steps copied, twists of the reference and statuses; target(k) is that of tick k."""
    v = np.zeros(7) if v is None else v
    steps, twists, statuses = [], [], []
    for k in range(round(time / DT)):
        step = follower.step(q, v, target(k)).copy()
        assert (np.abs(step.v) <= PANDA.limits.v_max * (1.0 + 1e-9)).all()
        assert (np.abs(step.v - v) <= DT * PANDA.limits.a_max * (1.0 + 1e-6)).all()
        q, v = step.q, step.v
        steps.append(step)
        twists.append(follower.target.twist.copy())
        statuses.append(follower.status)
    return steps, np.array(twists), statuses


def moved(*shift):
    pose = START.copy()
    pose[:3, 3] += shift
    return pose


def operated(twist, last, every=10):
    """A twist whose stamp grows every ``every`` ticks until tick ``last``."""
    return lambda k: ftqp.Target(twist=twist, stamp=min(k, last) // every)


def test_target_behind_a_wall_is_waited_for_with_one_status_as_long_as_nothing_changes():
    scene = ftqp.Scene()
    scene.add("wall", ftqp.HalfSpace((START[0, 3] + 0.15, 0.0, 0.0), (-1.0, 0.0, 0.0)))
    follower = follower_of(scene=scene)
    steps, _, statuses = run(follower, lambda k: ftqp.Target(pose=moved(0.4, 0.0, 0.0)), 4.0)
    first = statuses.index(ftqp.TargetStatus.WAITING)
    assert first < len(statuses) // 2 and np.abs(steps[-1].v).max() < 0.01
    assert set(statuses[first:]) == {ftqp.TargetStatus.WAITING}
    _, _, statuses = run(follower, lambda k: ftqp.Target(pose=START), 2.0, steps[-1].q, steps[-1].v)
    assert statuses[-1] is ftqp.TargetStatus.FOLLOWING


@pytest.mark.long
def test_target_that_jumps_half_a_metre_is_followed_within_the_limits(level):
    """Without the limiter the emergency stop takes such a jump for a fault."""
    goal = ftqp.Target(pose=moved(0.0, 0.5, 0.0))
    steps, twists, statuses = run(follower_of(level), lambda k: goal, 3.0)
    assert np.linalg.norm(twists[:, :3], axis=1).max() == pytest.approx(0.3, rel=1e-3)
    assert np.linalg.norm(PANDA.pose(steps[-1].q)[:3, 3] - goal.position) < 1e-6
    assert {step.status for step in steps} == {ftqp.StepStatus.OK}
    assert set(statuses) == {ftqp.TargetStatus.FOLLOWING}
    jerk = np.linalg.norm(np.diff(twists[:, :3], n=2, axis=0), axis=1) / DT**2
    assert jerk.max() <= 1.01 * 1.5 / 0.05


def test_stale_twist_fades_to_rest_after_the_dead_man_time_with_limited_jerk(level):
    steps, twists, statuses = run(follower_of(level), operated([0.0, 0.2, 0.0, 0.0, 0.0, 0.0], 250), 2.0)
    last_fresh = 250
    stale = next(k for k, status in enumerate(statuses) if status is ftqp.TargetStatus.STALE)
    assert (stale - last_fresh) * DT == pytest.approx(0.2, abs=DT)
    assert not twists[-1].any() and (np.abs(steps[-1].v) < 1e-3 * PANDA.limits.v_max).all()
    jerk = np.linalg.norm(np.diff(twists[:, :3], n=2, axis=0), axis=1) / DT**2
    assert jerk.max() <= 1.01 * 1.5 / 0.05


@pytest.mark.parametrize("stamps", [
    lambda k: 7.0, lambda k: -k, lambda k: np.nan, lambda k: np.inf, lambda k: k % 5,
], ids=["repeated", "backwards", "NaN", "infinite", "in a circle"])  # fmt: skip
def test_stamps_that_do_not_grow_end_the_motion(stamps):
    twist = [0.0, 0.2, 0.0, 0.0, 0.0, 0.0]
    steps, twists, statuses = run(follower_of(), lambda k: ftqp.Target(twist=twist, stamp=stamps(k)), 1.0)
    assert statuses[-1] is ftqp.TargetStatus.STALE and not twists[-1].any()
    assert np.linalg.norm(PANDA.pose(steps[-1].q)[:3, 3] - START[:3, 3]) < 0.1


@pytest.mark.parametrize("twist", [[np.nan] * 6, [0.1, np.inf, 0, 0, 0, 0]], ids=["NaN", "infinite"])
def test_twist_that_is_not_finite_counts_as_none(twist):
    good = [0.0, 0.2, 0.0, 0.0, 0.0, 0.0]
    steps, twists, statuses = run(
        follower_of(), lambda k: ftqp.Target(twist=good if k < 200 else twist, stamp=k), 1.5
    )
    assert np.isfinite(twists).all() and not twists[-1].any()
    assert statuses[-1] is ftqp.TargetStatus.STALE
    assert {step.status for step in steps} == {ftqp.StepStatus.OK}


def test_huge_and_jumping_twists_stay_within_the_limits():
    rng = np.random.default_rng(3)
    demands = rng.normal(size=(30, 6)) * 10.0 ** rng.integers(-2, 12, (30, 1))
    _, twists, _ = run(follower_of(), lambda k: ftqp.Target(twist=demands[k // 25], stamp=k), 1.5)
    assert np.linalg.norm(twists[:, :3], axis=1).max() <= 0.3 * 1.001
    assert np.linalg.norm(twists[:, 3:], axis=1).max() <= 1.0 * 1.001
    jerk = np.linalg.norm(np.diff(twists[:, :3], n=2, axis=0), axis=1) / DT**2
    assert jerk.max() <= 1.01 * 1.5 / 0.05


@pytest.mark.long
def test_nothing_winds_up_when_the_operator_pushes_out_of_reach(level):
    """Two seconds and a half outwards, then back: the tip turns round at once."""
    out = np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0])
    # in calm the arm folds into its limits on the way back: docs/theory/settling.md, "What is not solved"
    follower = follower_of(level, task=ftqp.Task(rows="position", calm=False))
    steps, _, statuses = run(follower, lambda k: ftqp.Target(twist=out if k < 1200 else -out, stamp=k), 3.8)
    assert ftqp.TargetStatus.WAITING in statuses
    assert max(step.position_error for step in steps) < 0.05
    assert not {step.status for step in steps} & {ftqp.StepStatus.STOPPING, ftqp.StepStatus.STOPPED}
    x = np.array([PANDA.pose(step.q)[0, 3] for step in steps])
    assert x[1899] < x[1200] - 0.05


def test_joint_that_fails_on_the_way_does_not_throw_the_tip_off(level):
    follower = follower_of(level)

    def target(k):
        if k == 150:
            follower.planner.report(ftqp.Locked("panda_joint3"))
        return ftqp.Target(twist=[0.0, 0.2, 0.0, 0.0, 0.0, 0.0], stamp=k)

    steps, _, _ = run(follower, target, 0.8)
    assert max(step.position_error for step in steps) < 2e-3
    assert steps[-1].v[2] == 0.0


@pytest.mark.parametrize(
    "spoilt", ["NaN", *(pytest.param(k, marks=pytest.mark.slow) for k in ("zeros", "mirrored"))]
)
def test_target_that_is_no_pose_brakes_the_arm_and_is_named(spoilt):
    bad = ftqp.Target(pose=START)
    bad.pose[:3, :3] = {"NaN": np.nan, "zeros": 0.0, "mirrored": -np.eye(3)}[spoilt]
    good = ftqp.Target(pose=moved(0.0, 0.3, 0.0))
    follower = follower_of()
    steps, _, statuses = run(follower, lambda k: bad if 200 <= k < 400 else good, 3.0)
    assert set(statuses[200:400]) == {ftqp.TargetStatus.INVALID}
    assert {step.status for step in steps[200:400]} == {ftqp.StepStatus.INVALID_INPUT}
    assert np.abs(steps[399].v).max() < 1e-12
    assert np.linalg.norm(PANDA.pose(steps[-1].q)[:3, 3] - good.position) < 1e-6


def test_stopped_planner_is_told_and_its_stop_holds():
    stop = ftqp.EmergencyStop(position=1e-12, samples=1)
    follower = follower_of(emergency=stop)
    steps, _, statuses = run(follower, lambda k: ftqp.Target(pose=moved(0.0, 0.3, 0.0)), 1.0)
    assert statuses[-1] is ftqp.TargetStatus.HALTED
    assert steps[-1].status is ftqp.StepStatus.STOPPED


def test_reset_forgets_stamps():
    follower = follower_of()
    run(follower, lambda k: ftqp.Target(twist=REST, stamp=1000 + k), 0.1)
    follower.reset(HOME)
    _, _, statuses = run(follower, lambda k: ftqp.Target(twist=REST, stamp=k), 0.1)
    assert set(statuses) == {ftqp.TargetStatus.FOLLOWING}


def test_wrong_arguments_are_refused_in_a_sentence():
    planner = ftqp.Planner(PANDA)
    with pytest.raises(ftqp.InputError, match="dead_man"):
        ftqp.TargetFollower(planner, dead_man=0.0)
    with pytest.raises(ftqp.InputError, match="TipLimits"):
        ftqp.TargetFollower(planner, 0.3)
    follower = follower_of()
    with pytest.raises(ftqp.InputError, match=r"expected ftqp\.Target"):
        follower.step(HOME, np.zeros(7), START)
    with pytest.raises(ftqp.InputError, match="position only"):
        follower.step(HOME, np.zeros(7), ftqp.Target(position=START[:3, 3]))


def test_a_dead_man_time_in_milliseconds_is_noticed(caplog):
    ftqp.TargetFollower(ftqp.Planner(PANDA), dead_man=0.5)
    assert not caplog.records
    ftqp.TargetFollower(ftqp.Planner(PANDA), dead_man=200)
    assert "a dead_man of 200 s lets the end effector go on for 100 m" in caplog.text


def test_speed_scales_the_twist_of_an_operator():
    follower = follower_of()
    follower.planner.speed = 0.5
    _, twists, _ = run(follower, operated((0.0, 0.1, 0.0, 0.0, 0.0, 0.2), last=10**6), 0.6)
    np.testing.assert_allclose(twists[-1], [0.0, 0.05, 0.0, 0.0, 0.0, 0.1], atol=1e-9)
