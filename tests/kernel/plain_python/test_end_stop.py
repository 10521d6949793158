"""What the end stop of a joint that swings freely does, and its friction."""

from math import inf

import numpy as np
import pytest
from records import empty_record

from ftqp.kernel.free import end_stop
from ftqp.kernel.layout.enums import ACCELERATION, FREE, VELOCITY

N, DT, JOINT = 3, 0.01, 2
rng = np.random.default_rng(0)
A = rng.normal(size=(N, N))
M, H = A @ A.T + N * np.eye(N), np.array([1.0, -2.0, 3.0])
FRICTION, VISCOUS = 0.4, 0.2


def stop_record(level, *, q, v, coulomb=0.0):
    """An arm whose last joint swings freely between -1 and 1, its row of the QP as ticks make it."""
    K = empty_record()
    K.chain.n, K.state.dt, K.state.level = N, DT, level
    K.faults.code[JOINT] = FREE
    K.faults.order[:N], K.faults.working, K.faults.movable = range(N), N - 1, N
    K.faults.friction[JOINT], K.faults.coulomb[JOINT] = FRICTION, coulomb
    K.chain.viscous[:N] = VISCOUS
    K.limits.q_min[:N], K.limits.q_max[:N] = -1.0, 1.0
    K.state.q[JOINT], K.state.v[:N] = q, [0.3, -0.2, v]
    K.kinematics.M[:N, :N], K.kinematics.h[:N] = M, H
    K.qp.lb[:N], K.qp.ub[:N] = -50.0, 50.0
    C = M.copy()
    C[JOINT, JOINT] += DT * FRICTION
    scale = DT if level == VELOCITY else 1.0
    K.qp.C[:N, :N] = C
    now = M @ K.state.v[:N] - DT * H if level == VELOCITY else -H
    if level != VELOCITY:
        now[JOINT] -= FRICTION * v
    K.qp.l[:N] = K.qp.u[:N] = now
    return K, scale


def free_acceleration(K, x, level, v):
    """What the joint does by (M_ii + dt d) a_i = -h_i - M_ih a_h - d v_i, the others doing x."""
    a = (x - K.state.v[:N]) / DT if level == VELOCITY else x
    others = [0, 1]
    return (-H[JOINT] - M[JOINT, others] @ a[others] - FRICTION * v) / (M[JOINT, JOINT] + DT * FRICTION)


def others_so_that(a_free, level, v):
    """x of the others by which the free joint would have an acceleration."""
    total = -H[JOINT] - FRICTION * v - a_free * (M[JOINT, JOINT] + DT * FRICTION)
    a = M[JOINT, :2] * total / (M[JOINT, :2] @ M[JOINT, :2])
    x = np.zeros(N)
    x[:2] = np.array([0.3, -0.2]) + DT * a if level == VELOCITY else a
    return x


@pytest.mark.parametrize("level", [ACCELERATION, VELOCITY])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(
    ("gap", "v", "a", "touches"),
    [
        (0.5e-3, 0.0, -1.0, True),  # pressed
        (0.5e-3, 0.0, 1.0, False),  # drawn away by the others
        (2e-3, 0.0, -1.0, False),  # not there yet
        (0.5e-3, 0.06, -1.0, False),  # thrown back
        (0.5e-3, -0.02, -1.0, True),  # meets it
    ],
)
def test_a_stop_pushes_and_never_pulls(level, side, gap, v, a, touches):
    q, v = -side * (1.0 - gap), side * v
    K, _ = stop_record(level, q=q, v=v)
    x = others_so_that(side * a, level, v)
    before = K.qp.l[:N].copy()
    end_stop.end_stops(K, x)
    assert K.free.contact[JOINT] == (side if touches else 0)
    if not touches:
        assert K.qp.lb[JOINT] == -50.0 and K.qp.l[JOINT] == before[JOINT] and K.state.v[JOINT] == v
        return
    assert K.qp.lb[JOINT] == 0.0 == K.qp.ub[JOINT] and K.state.v[JOINT] == 0.0, "the stop took its speed"
    a_others = (x - [0.3, -0.2, 0.0]) / DT if level == VELOCITY else x
    carries = H[JOINT] + M[JOINT, :2] @ a_others[:2]
    row = M[JOINT, :2] @ x[:2]
    open_side, bound = (K.qp.u, K.qp.l) if side > 0 else (K.qp.l, K.qp.u)
    assert open_side[JOINT] == side * inf
    scale = DT if level == VELOCITY else 1.0
    assert (row - bound[JOINT]) / scale == pytest.approx(carries), "0 where the stop carries nothing"
    if level == VELOCITY:
        assert K.qp.l[:2] == pytest.approx(M[:2, :2] @ [0.3, -0.2] - DT * H[:2]), "nor do the others carry it"
    K.state.a_command[:N] = [*a_others[:2], 0.0]
    end_stop.stop_torques(K)
    assert K.free.tau_stop[JOINT] == pytest.approx(carries)


def test_one_in_contact_loses_it_farther_away_than_it_found_it():
    for was, touches in ((0, 0), (1, 1)):
        K, _ = stop_record(ACCELERATION, q=-1.0 + 3e-3, v=0.0)
        K.free.contact[JOINT] = was
        end_stop.end_stops(K, others_so_that(-1.0, ACCELERATION, 0.0))
        assert K.free.contact[JOINT] == touches


def test_the_observer_is_told_of_an_impact_unless_it_looks_at_a_time_before():
    for latency in (0, 1):
        K, _ = stop_record(ACCELERATION, q=-1.0, v=-0.02)
        K.feedback.latency, K.feedback.v_hat[JOINT], K.feedback.d_hat[JOINT] = latency, -0.02, 3.0
        end_stop.end_stops(K, others_so_that(-1.0, ACCELERATION, -0.02))
        assert (K.feedback.v_hat[JOINT] == 0.0 == K.feedback.d_hat[JOINT]) == (latency == 0)


def test_what_an_impact_leaves_without_pressure_is_not_in_contact():
    """Its friction pressed it; once the stop has its speed, the others draw it away."""
    v = -0.02
    K, _ = stop_record(ACCELERATION, q=-1.0, v=v)
    pressed = 0.5 * FRICTION * v / (M[JOINT, JOINT] + DT * FRICTION)  # between with and without friction
    end_stop.end_stops(K, others_so_that(-v / DT + pressed, ACCELERATION, 0.0))
    assert K.free.contact[JOINT] == 0


@pytest.mark.parametrize("level", [ACCELERATION, VELOCITY])
@pytest.mark.parametrize("after", [0.1, -0.1, 0.0])
def test_coulomb_friction_acts_against_the_motion_or_holds_the_joint(level, after):
    mu, v = 2.0, 0.05
    K, scale = stop_record(level, q=0.0, v=v, coulomb=mu)
    before = K.qp.l[JOINT]
    end_stop.end_stops(K, others_so_that((after - v) / DT, level, v))
    if after == 0.0:
        assert (K.qp.l[JOINT], K.qp.u[JOINT]) == pytest.approx((before - scale * mu, before + scale * mu))
        assert K.qp.lb[JOINT] == K.qp.ub[JOINT] == pytest.approx(0.0 if level == VELOCITY else -v / DT)
        return
    assert K.qp.l[JOINT] == K.qp.u[JOINT] == pytest.approx(before - np.sign(after) * scale * mu)
    assert K.qp.lb[JOINT] == -50.0


def test_a_joint_that_friction_holds_presses_on_no_stop():
    K, _ = stop_record(ACCELERATION, q=-1.0, v=0.0, coulomb=5.0)
    end_stop.end_stops(K, others_so_that(-0.5, ACCELERATION, 0.0))
    assert K.free.contact[JOINT] == 0 and K.qp.lb[JOINT] == K.qp.ub[JOINT] == 0.0
