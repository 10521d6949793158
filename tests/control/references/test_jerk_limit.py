"""Motions with limited speed, acceleration and jerk."""

import numpy as np
import pytest

from ftqp.control.references.jerk_limit import Motion, State

DT = 1e-3
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
