import dataclasses

import numpy as np
import pytest

from ftqp import InputError
from ftqp.qp import QP


def test_absent_parts_are_empty_rows_and_infinite_bounds():
    qp = QP(np.eye(3), np.zeros(3))
    assert (qp.n, qp.m, qp.p) == (3, 0, 0)
    assert qp.A.shape == qp.C.shape == (0, 3)
    assert np.all(qp.lb == -np.inf)
    assert np.all(qp.ub == np.inf)


def test_one_sided_rows_get_an_infinite_other_side():
    qp = QP(np.eye(2), [0, 0], C=[[1, 0]], u=[3])
    assert qp.l[0] == -np.inf
    assert qp.u[0] == 3.0


def test_parts_are_copies_contiguous_and_read_only():
    H, g = np.eye(2), np.zeros(2)
    qp = QP(np.asfortranarray(H), g, A=np.ones((4, 2))[::2], b=[0, 0])
    H[0, 0] = g[0] = 7.0
    assert qp.H[0, 0] == 1.0
    assert qp.g[0] == 0.0
    for field in dataclasses.fields(qp):
        part = getattr(qp, field.name)
        assert part.flags.c_contiguous
        assert not part.flags.writeable
    with pytest.raises(dataclasses.FrozenInstanceError):
        qp.H = np.eye(2)


def test_rounding_asymmetry_is_removed():
    H = np.array([[2.0, 1.0], [1.0 + 1e-12, 2.0]])
    qp = QP(H, [0, 0])
    assert qp.H[0, 1] == qp.H[1, 0]


def test_a_semidefinite_hessian_is_accepted():
    assert QP(np.diag([1.0, 0.0]), [0, 0]).n == 2
    assert QP(np.zeros((2, 2)), [0, 0]).n == 2


def test_the_objective_is_half_x_h_x_plus_g_x():
    assert QP(np.diag([2.0, 4.0]), [1.0, -1.0]).objective(np.array([1.0, 2.0])) == pytest.approx(8.0)


GOOD = dict(H=np.eye(2), g=np.zeros(2))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (dict(g=[]), "g is empty"),
        (dict(g=1.0), "g has shape (), expected a vector"),
        (dict(g=[[1.0], [1.0, 2.0]]), "g is not an array of numbers"),
        (dict(g=[0.0, np.nan]), "g contains NaN at index 1"),
        (dict(g=[0.0, np.inf]), "g is infinite at index 1"),
        (dict(H=np.eye(3)), "H has shape (3, 3), expected (n, n) = (2, 2)"),
        (dict(H=[["a", "b"], ["c", "d"]]), "H is not an array of numbers"),
        (dict(H=[[1.0, 0.5], [0.0, 1.0]]), "H is not symmetric (|H - H'| reaches 5.0e-01)"),
        (dict(H=[[1.0, 2.0], [2.0, 1.0]]), "H is indefinite (smallest eigenvalue -1)"),
        (dict(H=-np.eye(2)), "H is indefinite"),
        (dict(A=[[1.0, 1.0]]), "A was given without b"),
        (dict(b=[1.0]), "b was given without A"),
        (dict(A=[[1.0, 1.0, 1.0]], b=[1.0]), "A has shape (1, 3), expected (m, n) = (1, 2)"),
        (dict(A=[[1.0, np.inf]], b=[1.0]), "A is infinite at index 0, 1"),
        (dict(C=[[1.0, 1.0]]), "C was given without bounds"),
        (dict(u=[1.0]), "u was given without C"),
        (dict(C=[[1.0, 1.0]], l=[0.0, 0.0]), "C has shape (1, 2), expected (p, n) = (2, 2)"),
        (dict(C=[[1.0, 1.0]], l=[2.0], u=[1.0]), "l[0] = 2 and u[0] = 1 leave nothing between them"),
        (dict(lb=[0.0, 1.0], ub=[0.0, 0.5]), "lb[1] = 1 and ub[1] = 0.5 leave nothing between them"),
        (dict(lb=[np.inf, 0.0]), "lb[0] = inf and ub[0] = inf leave nothing between them"),
        (dict(ub=[1.0]), "ub has shape (1,), expected (n,) = (2,)"),
        (dict(lb=[np.nan, 0.0]), "lb contains NaN at index 0"),
    ],
)
def test_a_wrong_part_is_refused_in_one_sentence(change, sentence):
    with pytest.raises(InputError) as error:
        QP(**(GOOD | change))
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)
