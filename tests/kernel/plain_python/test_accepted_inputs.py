"""Whether a target and a state can be used, number by number."""

import numpy as np
import pytest
from records import empty_record

from ftqp.kernel.layout.enums import TARGET_HAS_ROTATION, TARGET_TWIST
from ftqp.kernel.ticks import accepted_inputs

N = 11


def record(has_rotation=1.0):
    """A target that can be used, and an arm of eleven joints at rest."""
    K = empty_record(16)
    K.chain.n = N
    pose = np.eye(4)
    pose[:3, 3] = 0.5, -0.2, 0.1
    K.task.target[:TARGET_TWIST] = pose.ravel()
    K.task.target[TARGET_TWIST:TARGET_HAS_ROTATION] = np.linspace(
        -1.0, 1.0, TARGET_HAS_ROTATION - TARGET_TWIST
    )
    K.task.target[TARGET_HAS_ROTATION] = has_rotation
    K.state.q_command[:N], K.state.v_command[:N] = np.arange(N), 0.1 * np.arange(N)
    K.state.q[:N], K.state.v[:N] = np.arange(N) + 0.5, 0.3
    return K


@pytest.mark.parametrize("has_rotation", [0.0, 1.0])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_one_number_that_is_not_finite_makes_a_target_unusable(bad, has_rotation):
    assert accepted_inputs.target_is_usable(record(has_rotation).task)
    for at in range(TARGET_HAS_ROTATION):
        K = record(has_rotation)
        K.task.target[at] = bad
        assert not accepted_inputs.target_is_usable(K.task), at


def test_a_rotation_has_to_be_one_where_there_is_one():
    for has_rotation, usable in ((1.0, False), (0.0, True)):
        K = record(has_rotation)
        K.task.target[0] = 1.5
        assert accepted_inputs.target_is_usable(K.task) == usable


@pytest.mark.parametrize("name", ["q", "v"])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_state_that_is_not_finite_gives_way_to_the_last_command(name, bad):
    K = record()
    assert accepted_inputs.state_is_finite(K.state, K.chain)
    for joint in (0, 7, 8, N - 1):
        K = record()
        K.state[name][joint] = bad
        assert not accepted_inputs.state_is_finite(K.state, K.chain)
        assert np.array_equal(K.state.q[:N], np.arange(N))
        assert np.array_equal(K.state.v[:N], 0.1 * np.arange(N))
    K = record()
    K.state.unusable = 1
    assert not accepted_inputs.state_is_finite(K.state, K.chain) and K.state.q[3] == 3.0


@pytest.mark.parametrize("turns", [-3, 0, 2])
@pytest.mark.parametrize("beside", [-3.1, -0.5, 0.0, 0.5, 3.1])
def test_an_angle_of_cosine_and_sine_is_that_of_the_turn_of_the_command(turns, beside):
    K = record()
    K.chain.n, K.chain.continuous[:3] = 3, [0, 1, 0]
    command = 1.0 + 2.0 * np.pi * turns
    K.state.q_command[:3] = [0.0, command, 0.0]
    angle = command + beside
    K.state.given_q[:4], K.state.given_v[:3] = [0.25, np.cos(angle), np.sin(angle), -0.75], [1.0, 2.0, 3.0]
    accepted_inputs.accept_state(K.state, K.chain, 4)
    assert np.allclose(K.state.q[:3], [0.25, angle, -0.75], atol=1e-12)
    assert K.state.v[:3].tolist() == [1.0, 2.0, 3.0]
    K.state.given_q[1:3] = [np.nan, 0.0]
    accepted_inputs.accept_state(K.state, K.chain, 4)
    assert np.isnan(K.state.q[1]) and K.state.q[2] == -0.75


def test_whole_turns_are_those_that_leave_half_a_turn_at_most():
    for angle in np.linspace(-20.0, 20.0, 401):
        assert accepted_inputs.whole_turns(angle) == np.round(angle / (2.0 * np.pi)), angle
    assert accepted_inputs.whole_turns(np.nan) == 0.0 == accepted_inputs.whole_turns(1e300)


@pytest.mark.parametrize("at", [1, 2])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_an_angle_of_which_cosine_or_sine_is_no_number_is_none(at, bad):
    K = record()
    K.chain.n, K.chain.continuous[:3] = 3, [0, 1, 0]
    K.state.given_q[:4] = [0.25, 0.6, 0.8, -0.75]
    K.state.given_q[at] = bad
    accepted_inputs.accept_state(K.state, K.chain, 4)
    assert not np.isfinite(K.state.q[1]) and K.state.q[2] == -0.75


def test_only_joints_without_end_are_unwrapped():
    K = record()
    K.chain.n, K.chain.continuous[:3], K.state.q_command[:3] = 3, [0, 1, 0], 13.0
    K.state.given_q[:3] = 0.5
    accepted_inputs.accept_state(K.state, K.chain, 3)
    assert K.state.q[:3] == pytest.approx([0.5, 0.5 + 4.0 * np.pi, 0.5])
