"""A log is looked at in pieces of its own times; one that cannot be one is refused in a sentence."""

from typing import Any

import numpy as np
import pytest

import ftqp
from ftqp.model.fitting.fitted_arm import KINDS, symmetric, torques
from ftqp.model.fitting.torque_log import Pieces, pieces_of


def wave(t: np.ndarray) -> ftqp.TorqueLog:
    q = np.stack([np.sin(2.0 * t), 0.5 * np.cos(3.0 * t)], axis=1)
    return ftqp.TorqueLog(t=t, q=q, tau=q)


@pytest.mark.parametrize("jitter", [0.0, 0.4])
def test_speed_and_acceleration_are_those_of_the_motion(jitter: float) -> None:
    t = np.arange(0.0, 5.0, 0.004)
    pieces = pieces_of(wave(t + jitter * 0.004 * np.random.default_rng(0).random(len(t))))
    np.testing.assert_allclose(pieces.v[:, 0], 2.0 * np.cos(2.0 * pieces.t), atol=1e-3)
    np.testing.assert_allclose(pieces.a[:, 0], -4.0 * np.sin(2.0 * pieces.t), atol=1e-2)


def test_torques_that_act_later_are_put_beside_their_positions() -> None:
    t, late = np.arange(0.0, 5.0, 0.004), 0.01
    q = np.sin(2.0 * t)[:, None]
    pieces = pieces_of(ftqp.TorqueLog(t=t, q=np.sin(2.0 * (t - late))[:, None], tau=q, late=late))
    np.testing.assert_allclose(pieces.q, pieces.tau, atol=1e-4)


def test_samples_that_are_too_rare_are_refused() -> None:
    with pytest.raises(ftqp.InputError, match="has 10 samples a second, expected 33 at least"):
        pieces_of(wave(np.arange(0.0, 20.0, 0.1)))


@pytest.mark.parametrize(
    ("t", "q", "message"),
    [
        ([0.0, 0.1, 0.1] * 4, np.zeros((12, 2)), "t of the log does not rise from row 1"),
        (np.arange(12.0), np.full((12, 2), np.nan), "q of the log is not finite at row 0"),
        (np.arange(12.0), np.zeros((11, 2)), r"expected \(K,\), \(K, nv\) and \(K, nv\)"),
        (np.arange(3.0), np.zeros((3, 2)), "the log has 3 samples"),
        (np.arange(12.0), "positions", "q of the log is not an array of numbers"),
    ],
)
def test_what_is_no_log_is_refused(t: object, q: object, message: str) -> None:
    with pytest.raises(ftqp.InputError, match=message):
        ftqp.TorqueLog(t=t, q=q, tau=np.zeros((12, 2)) if np.shape(q) != (3, 2) else q)  # type: ignore[arg-type]


def _at(motion: Any) -> Pieces:
    every = slice(100, None, 400)
    q, v, a = motion.q[every], motion.v[every], motion.a[every]
    return Pieces(motion.t[every], q, v, a, np.zeros_like(q), 0.0, 0.0)


def test_torques_are_those_of_the_model(panda: ftqp.Robot, motion: Any) -> None:
    robot, at = panda.with_friction(viscous=0.4).with_rotors(0.1), _at(motion)
    own = [robot.mass_matrix(q) @ a + robot.bias(q, v) for q, v, a in zip(at.q, at.v, at.a, strict=True)]
    np.testing.assert_allclose(torques(robot, at), own, atol=1e-10)


def test_a_load_is_linear_in_mass_moments_and_inertia(panda: ftqp.Robot, motion: Any) -> None:
    load, at = ftqp.Payload(2.0, (0.05, -0.1, 0.2), np.diag([0.01, 0.02, 0.025])), _at(motion)
    about = np.array(load.inertia) + load.mass * (
        load.com @ load.com * np.eye(3) - np.outer(load.com, load.com)
    )
    six = [about[i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
    np.testing.assert_allclose(symmetric(np.array(six)), about)
    unknown = np.array([load.mass, *(load.mass * load.com), *six])
    added = torques(panda.with_payload(load), at) - torques(panda, at)
    columns = KINDS["load"].columns(panda, at, added)
    np.testing.assert_allclose(columns @ unknown, added, atol=1e-10)
