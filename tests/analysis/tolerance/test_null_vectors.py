"""Null vectors with a sign of their own, and minors."""

import numpy as np
import pytest

from ftqp.analysis.survival.continuing import track
from ftqp.analysis.survival.task_path import task_path
from ftqp.analysis.tolerance import minors, null_vector
from ftqp.control.paths import Line
from ftqp.core.errors import InputError
from ftqp.model import catalog

RANDOM = np.random.default_rng(7).normal(size=(1000, 6, 7))


def test_null_vector_times_manipulability_is_the_minors() -> None:
    n, Z = null_vector(RANDOM), minors(RANDOM)
    w = np.sqrt(np.linalg.det(RANDOM @ np.swapaxes(RANDOM, 1, 2)))
    assert (np.linalg.norm(w[:, None] * n - Z, axis=1) < 1e-9 * np.linalg.norm(Z, axis=1)).all()
    assert np.abs(np.einsum("kmn,kn->km", RANDOM, n)).max() < 1e-12


def test_null_vector_keeps_its_sign_along_a_path_and_under_units_of_rows() -> None:
    panda = catalog.load("panda")
    q0 = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
    task = task_path(panda, Line(panda.pose(q0), (0.0, 0.3, 0.1), duration=4.0), dt=0.02)
    J = np.stack([panda.jacobian(one) for one in track(task, q0, 0.5)])
    n = null_vector(J)
    assert (np.einsum("ki,ki->k", n[1:], n[:-1]) > 0.99).all()
    scaled = J * np.array([1000.0, 1000.0, 1000.0, 57.3, 57.3, 57.3])[:, None]
    assert np.allclose(null_vector(scaled), n, atol=1e-9)


def test_planar_minors_are_those_of_the_formula() -> None:
    arm = catalog.load("planar", lengths=(1.0, 1.0, 1.0))
    q = np.array([0.3, 0.7, -1.1])
    (s2, s3), s23 = np.sin(q[1:]), np.sin(q[1] + q[2])
    wanted = np.array([s3, -(s3 + s23), s2 + s23])
    assert np.allclose(minors(arm.jacobian(q)[:2]), wanted)


@pytest.mark.parametrize(
    ("J", "sentence"),
    [
        (np.ones((6, 8)), "expected one column more than rows"),
        (np.ones(7), r"J has shape \(7,\)"),
        (np.full((6, 7), np.nan), "J is not finite"),
        ("J", "expected a Jacobian"),
    ],
)
def test_what_has_no_null_vector_is_refused(J: object, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        null_vector(J)
