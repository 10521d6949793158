"""Columns of the unknowns are what they add to the torques."""

from typing import Any

import numpy as np

import ftqp
from ftqp.model.fitting.torque_log import Pieces
from ftqp.model.fitting.unknowns import KINDS, symmetric, torques


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


def test_offsets_change_torques_by_their_derivative(panda: ftqp.Robot, motion: Any) -> None:
    at, step = _at(motion), 1e-6
    columns = KINDS["offsets"].columns(panda, at, np.zeros_like(at.q))
    for j in range(panda.nv):
        moved = at._replace(q=at.q + step * np.eye(panda.nv)[j])
        slope = (torques(panda, moved) - torques(panda, at)) / step
        np.testing.assert_allclose(columns[:, :, j], slope, atol=1e-3)
