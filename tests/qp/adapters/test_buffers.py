import numpy as np
import pytest

from ftqp import InputError
from ftqp.qp import QPBuffers


def test_every_part_is_a_contiguous_view_of_one_array():
    qp = QPBuffers.zeros(4, 2, 3)
    for name in ("H", "g", "rows", "A", "b", "C", "l", "u", "lb", "ub"):
        part = getattr(qp, name)
        assert part.flags.c_contiguous
        assert np.shares_memory(part, qp.flat)
    for name in ("x", "y", "z", "z_box", "multipliers"):
        assert np.shares_memory(getattr(qp, name), qp.solution)


def test_flat_is_the_problem_in_the_documented_order():
    n, m, p = 4, 2, 3
    qp = QPBuffers.zeros(n, m, p)
    qp.flat[:] = np.arange(len(qp.flat))
    order = [qp.H, qp.g, qp.A, qp.C, qp.lb, qp.b, qp.l, qp.ub, qp.upper[n : n + m], qp.u]
    np.testing.assert_array_equal(np.concatenate([part.ravel() for part in order]), qp.flat)
    qp.solution[:] = np.arange(len(qp.solution))
    np.testing.assert_array_equal(np.concatenate([qp.x, qp.z_box, qp.y, qp.z]), qp.solution)


def test_new_buffers_hold_a_qp_without_constraints():
    qp = QPBuffers.zeros(3, 1, 2)
    np.testing.assert_array_equal(qp.H, np.eye(3))
    assert np.all(qp.lb == -np.inf)
    assert np.all(qp.u == np.inf)
    assert np.all(qp.b == 0.0)
    assert (qp.n, qp.m, qp.p) == (3, 1, 2)


@pytest.mark.parametrize("size", [(0, 0, 0), (2, -1, 0), (2, 0, -1)])
def test_impossible_sizes_are_refused(size):
    with pytest.raises(InputError, match="a QP cannot have n = "):
        QPBuffers.zeros(*size)
