"""References of tip and joints: within limits, of jerk too."""

import numpy as np
import pytest

import ftqp
from ftqp.control.references.jerk_limit import Motion, State, TipLimits, TipReference
from ftqp.core.pose import rotation_exp, rotation_vectors, transform

DT = 1e-3
LIMITS = TipLimits(speed=0.4, acceleration=1.5, turn=1.2, turn_acceleration=5.0, rise_time=0.05)
START = transform(rotation_exp(np.array([0.3, -0.2, 0.5])), np.array([0.4, 0.1, 0.6]))


def moved(shift, turn):
    return transform(rotation_exp(np.array(turn, dtype=float)) @ START[:3, :3], START[:3, 3] + shift)


def motion(each, ticks):
    """Poses, twists and accelerations of a reference that begins at rest; each(reference, k) moves it."""
    reference = TipReference(LIMITS, DT)
    reference.begin(START, np.zeros(6))
    found = []
    for k in range(ticks):
        each(reference, k)
        pose = transform(reference.R, reference.p)
        found.append((pose, reference.twist.copy(), reference.acceleration.copy()))
    return [np.array(part) for part in zip(*found, strict=True)]


def jumping(seed, every):
    rng = np.random.default_rng(seed)
    goals = [moved(rng.uniform(-0.5, 0.5, 3), rng.uniform(-1.5, 1.5, 3)) for _ in range(20)]
    return lambda reference, k: reference.towards(goals[k // every % 20], np.zeros(6))


def norms(array):
    return np.linalg.norm(array[:, :3], axis=1).max(), np.linalg.norm(array[:, 3:], axis=1).max()


def test_one_jump_is_straight_and_as_fast_as_the_limits_allow():
    goal = moved([0.3, -0.2, 0.1], [0.0, 0.0, 0.9])
    poses, twists, accelerations = motion(lambda r, k: r.towards(goal, np.zeros(6)), 2500)
    assert np.abs(poses[-1] - goal).max() < 1e-9 and not twists[-1].any()
    way = poses[:, :3, 3] - START[:3, 3]
    along = np.array([0.3, -0.2, 0.1]) / np.linalg.norm([0.3, -0.2, 0.1])
    assert np.abs(way - np.outer(way @ along, along)).max() < 1e-9
    assert norms(twists) == pytest.approx((0.4, 1.2), rel=1e-3) or norms(twists)[0] == pytest.approx(0.4)
    assert norms(accelerations)[0] == pytest.approx(1.5)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(4))
def test_limits_hold_for_the_norms_when_goals_jump_at_rest(seed):
    """A turn about a moving axis adds its own acceleration, so its bound is that of a fixed axis."""
    _, twists, accelerations = motion(jumping(seed, 4000), 8000)
    assert norms(twists)[0] <= 0.4 + 1e-9 and norms(twists)[1] <= 1.2 + 1e-9
    assert norms(accelerations)[0] <= 1.5 + 1e-9 and norms(accelerations)[1] <= 5.0 + 1e-9


@pytest.mark.parametrize("seed", range(6))
def test_norms_stay_below_root_two_times_the_limits_when_goals_jump_on_the_way(seed):
    """The old velocity is braked along its axes beside the new one."""
    _, twists, accelerations = motion(jumping(seed, 300), 3000)
    assert norms(twists)[0] <= 2.0**0.5 * 0.4 and norms(twists)[1] <= 2.0**0.5 * 1.2
    assert norms(accelerations)[0] <= 2.0**0.5 * 1.5
    jerk = np.diff(accelerations, axis=0) / DT
    assert norms(jerk)[0] <= 1.01 * 1.5 / 0.05


@pytest.mark.parametrize("seed", range(3))
def test_twist_and_acceleration_are_derivatives_of_the_pose(seed):
    """The jerk of up to 100 rad/s3 jumps between samples."""
    poses, twists, accelerations = motion(jumping(seed, 250), 1500)
    turns = rotation_vectors(poses[1:, :3, :3] @ np.swapaxes(poses[:-1, :3, :3], 1, 2)) / DT
    assert np.abs(turns - 0.5 * (twists[1:, 3:] + twists[:-1, 3:])).max() < 1e-4
    linear = np.diff(poses[:, :3, 3], axis=0) / DT
    assert np.abs(linear - 0.5 * (twists[1:, :3] + twists[:-1, :3])).max() < 1e-5
    change = np.diff(twists, axis=0) / DT
    assert np.abs(change - 0.5 * (accelerations[1:] + accelerations[:-1])).max() <= 0.25 * 100.0 * DT + 1e-3


def test_half_a_turn_is_made_to_the_end():
    goal = moved([0.0, 0.0, 0.0], [np.pi, 0.0, 0.0])
    poses, _, _ = motion(lambda r, k: r.towards(goal, np.zeros(6)), 4000)
    assert np.abs(poses[-1] - goal).max() < 1e-9


@pytest.mark.long
def test_goal_that_moves_is_caught_up_with():
    def each(reference, k):
        shift = 0.1 * np.sin(0.8 * (k + 1) * DT)
        twist = np.array([0.08 * np.cos(0.8 * (k + 1) * DT), 0, 0, 0, 0, 0])
        reference.towards(moved([shift + 0.05, 0.0, 0.0], [0, 0, 0]), twist)

    poses, _, _ = motion(each, 2500)
    truth = START[0, 3] + 0.05 + 0.1 * np.sin(0.8 * 2500 * DT)
    assert abs(poses[-1, 0, 3] - truth) < 1e-3


def test_twist_is_reached_and_kept_and_a_huge_one_cut():
    wanted = np.array([1e12, 0.0, 0.0, 0.0, 0.0, 0.5])
    poses, twists, _ = motion(lambda r, k: r.along(wanted), 2000)
    assert np.abs(twists[-1] - [0.4, 0, 0, 0, 0, 0.5]).max() < 1e-9
    R = poses[:, :3, :3]
    assert np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max() < 1e-12


def test_twist_that_ends_is_braked_to_rest_with_limited_jerk():
    wanted = np.array([0.2, -0.3, 0.1, 0.8, 0.0, -0.5])
    _, twists, accelerations = motion(lambda r, k: r.along(wanted if k < 500 else np.zeros(6)), 1500)
    assert not twists[-1].any()
    assert norms(np.diff(accelerations, axis=0) / DT)[0] <= 1.01 * 1.5 / 0.05


@pytest.mark.parametrize("name", ["speed", "acceleration", "turn", "turn_acceleration", "rise_time"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_limit_that_is_not_positive_is_refused_by_name(name, value):
    with pytest.raises(ftqp.InputError, match=name):
        ftqp.TipLimits(**{name: value})


V, A, J = np.array([1.0, 0.5]), np.array([4.0, 2.0]), np.array([40.0, 30.0])
REST = State(np.zeros(2), np.zeros(2), np.zeros(2))


def samples(motion, longest=None):
    times = np.arange(0.0, (motion.duration if longest is None else longest) + DT, DT)
    return [np.array(part) for part in zip(*(motion.at(t) for t in times), strict=True)]


def test_motion_arrives_and_keeps_every_limit():
    motion = Motion(2)
    assert motion.plan(REST, np.array([1.0, -0.7]), V, A, J)
    q, v, a = samples(motion)
    assert np.abs(q[-1] - [1.0, -0.7]).max() < 1e-9 and np.abs(v[-1]).max() < 1e-9
    assert (np.abs(v) <= V + 1e-9).all() and (np.abs(a) <= A + 1e-9).all()
    assert (np.abs(np.diff(a, axis=0)) <= J * DT + 1e-9).all()


def test_velocity_and_acceleration_are_derivatives():
    """The jerk jumps between samples, which is worth a quarter of J dt at most."""
    motion = Motion(2)
    motion.plan(State(np.zeros(2), np.array([0.3, -0.2]), np.array([1.0, 0.0])), np.ones(2), V, A, J)
    q, v, a = samples(motion)
    assert np.abs(np.diff(q, axis=0) / DT - 0.5 * (v[1:] + v[:-1])).max() < 1e-5
    assert np.abs(np.diff(v, axis=0) / DT - 0.5 * (a[1:] + a[:-1])).max() <= 0.25 * J.max() * DT


def test_brake_comes_to_rest_within_jerk():
    motion = Motion(2)
    motion.brake(State(np.zeros(2), np.array([1.0, -0.5]), np.zeros(2)), A, J)
    _, v, a = samples(motion)
    assert np.abs(v[-1]).max() < 1e-9
    assert (np.abs(np.diff(a, axis=0)) <= J * DT + 1e-9).all()


@pytest.mark.parametrize("goal", [np.nan, np.inf, 1e300])
def test_goal_that_is_no_place_brakes_the_motion(goal):
    motion = Motion(2)
    assert not motion.plan(State(np.zeros(2), V, np.zeros(2)), np.array([goal, 0.0]), V, A, J)
    q, v, _ = samples(motion, 2.0)
    assert np.isfinite(q).all() and np.abs(v[-1]).max() < 1e-9


def test_state_that_is_no_number_stands_still():
    motion = Motion(2)
    assert not motion.plan(State(np.zeros(2), np.array([np.nan, 0.0]), np.zeros(2)), np.ones(2), V, A, J)
    assert not motion.at(1.0).v.any()


@pytest.mark.long
def test_state_far_beyond_the_limits_from_which_no_way_is_found_brakes():
    """The tip of an arm that is stopped while it falls: the library's result has no name in Python."""
    state = State(
        np.array([-0.8238240613752218, -0.39175996453986994, -1.0589034618422886, 0.0, 0.0, 0.0]),
        np.array([-8.413436147302066, 7.386395483543982, 2.21020407867279,
                  1.2666350405446873, -1.2334056203403378, 8.583281455225793]),
        np.array([-78.62341780331217, -56.732153297097554, -1.5873244358313647,
                  -19.501984853129557, 29.606228266388825, 45.62731848518811]),
    )  # fmt: skip
    goal = np.array([-2.992076585140862, -1.3771937509825887, -1.7024985962979589,
                     -0.7765740730302972, -0.4156192669968259, -1.3641853933742747])  # fmt: skip
    v_max = np.array([0.4037902263249171, 0.2913621623145703, 0.045404223326142114,
                      0.5062684128821746, 0.7685729585338466, 1.184477902507385])  # fmt: skip
    motion = Motion(6)
    assert not motion.plan(state, goal, v_max, 4.0 * v_max, 80.0 * v_max)
    _, v, _ = samples(motion)
    assert np.abs(v[-1]).max() < 1e-6
