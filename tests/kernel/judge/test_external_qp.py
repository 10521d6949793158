"""The QP handed to an external solver has the in-kernel answer, and its answer comes back whole."""

import daqp
import numpy as np
import pytest
from random_qps import EQUALITY
from session_ticks import Ticks

import ftqp
from ftqp.kernel.judge.external_qp import sizes, unpack
from ftqp.kernel.layout import enums as codes
from ftqp.qp.adapters.buffers import QPBuffers

DT = 0.002
Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
V = np.array([0.3, -0.2, 0.1, 0.25, -0.4, 0.2, 0.35])
MODES = ("hard", "slack", "scaled", "lexicographic")
EXTRA = {"hard": 0, "slack": 6, "scaled": 7, "lexicographic": 6}


def packed(mode, level, *faults, scheme="dlsm"):
    """(buffers with the QP of a tick, the record it came from, the same tick solved in the kernel)."""
    robot = ftqp.robots.load("panda")
    pose = robot.pose(Q)
    pose[:3, 3] += [0.002, -0.001, 0.001]
    target = ftqp.Target(pose=pose, twist=[0.02, 0.01, 0.0, 0.0, 0.05, 0.0])
    outside, inside = (
        Ticks(robot, DT, *faults, level=level, scheme=scheme, task=ftqp.Task(mode=mode)) for _ in range(2)
    )
    for ticks in (outside, inside):
        ticks.reset(Q, V)
    outside.K.cascade.external = 1
    buffers = QPBuffers.zeros(*sizes(outside.K.task, outside.K.cascade, outside.K.chain))
    prepare = outside.session.bind("prepare_clock", buffers.flat)
    assert prepare(Q, V, target.packed, target.row) == codes.QP_READY
    inside.tick(Q, V, target)
    return buffers, outside.K, inside.K


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("mode", MODES)
def test_packed_qp_has_the_solution_of_the_kernel(mode, level):
    for faults in ((), (ftqp.Locked(2),), (ftqp.FreeSwinging(4),)):
        b, _, inside = packed(mode, level, *faults)
        assert b.n == 7 + EXTRA[mode]
        sense = np.where(b.lower == b.upper, EQUALITY, 0).astype(np.intc)
        upper = b.upper.copy()
        upper[b.n : b.n + b.m] = b.b
        x, _, flag, _ = daqp.solve(b.H, b.g, b.rows, upper, b.lower, sense, primal_tol=1e-11, dual_tol=1e-12)
        if mode == "hard" and flag != 1:
            assert inside.cascade.status == codes.RELAXED
            continue
        assert flag == 1
        assert np.abs(x[:7] - inside.qp.x[:7]).max() < 1e-6 * (1.0 + np.abs(x[:7]).max())


def test_packed_qp_repeats_the_record_term_by_term():
    b, K, _ = packed("slack", "acceleration")
    mean = np.trace(K.qp.H[:7, :7]) / 7
    assert np.array_equal(b.H[:7, :7], K.qp.H[:7, :7]) and np.all(b.H[:7, 7:] == 0.0)
    assert np.allclose(b.H[7:, 7:], mean * np.eye(6), rtol=1e-14)
    assert np.array_equal(b.g[:7], K.qp.g[:7]) and np.all(b.g[7:] == 0.0)
    assert np.array_equal(b.A[:, :7], K.qp.A[:6, :7])
    assert np.allclose(b.A[:, 7:] ** 2, np.diag(K.qp.soft[:6] * mean), rtol=1e-13)
    assert np.array_equal(b.C[:, :7], K.qp.C[:7, :7]) and np.all(b.C[:, 7:] == 0.0)
    for mine, theirs in ((b.b, "b"), (b.l, "l"), (b.u, "u"), (b.lb[:7], "lb"), (b.ub[:7], "ub")):
        assert np.array_equal(mine, K.qp[theirs][: len(mine)])
    assert np.all(b.lb[7:] == -np.inf) and np.all(b.ub[7:] == np.inf)


def test_packed_diagonal_hessian_is_written_out():
    b, K, _ = packed("hard", "velocity", scheme="mvn")
    assert K.qp.dense == 0
    assert np.array_equal(b.H, np.eye(7))


def test_answer_comes_back_whole():
    b, K, _ = packed("scaled", "acceleration")
    b.solution[:] = np.arange(len(b.solution)) + 0.5
    unpack(K.task, K.cascade, K.chain, K.qp, b.solution)
    for mine, theirs, count in ((b.x, "x", 8), (b.z_box, "z_box", 8), (b.y, "y", 6), (b.z, "z", 7)):
        assert np.array_equal(K.qp[theirs][:count], mine[:count])
