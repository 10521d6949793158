"""What motors are asked for: by the servos of a simulated arm, and by a planner that sends torques."""

import numpy as np
import pytest
from records import chain_record, empty_record

import ftqp
from ftqp.kernel.arm import servo
from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.entry.session import rooms
from ftqp.kernel.feedback import sent
from ftqp.kernel.layout.enums import FREE, HEALTHY, LOCKED, DriveKind
from ftqp.kernel.layout.servo_memory import servo_dtype

N = 4
rng = np.random.default_rng(0)
A = rng.normal(size=(N, N))
M = A @ A.T + N * np.eye(N)


@pytest.mark.parametrize("obeys", [[0, 1, 2, 3, 4, 5, 6], [0, 2, 3, 4, 5, 6]])
def test_servos_ask_for_what_moves_those_that_obey_and_say_when_a_motor_is_full(obeys):
    robot = ftqp.robots.load("panda")
    K, S = chain_record(robot), rooms(np.zeros(1, servo_dtype(8)))
    q, v = robot.neutral + 0.1, 0.2 * rng.normal(size=7)
    S.stiffness, S.damping = 400.0, 40.0
    S.q[:7], S.v[:7] = q + 0.01 * rng.normal(size=7), 0.2 * rng.normal(size=7)
    K.state.q[:7], K.state.v[:7] = q, v
    S.limit[:7] = S.tau_max[:7] = robot.limits.tau_max
    S.unresponsive[[j for j in range(7) if j not in obeys]] = 1.0
    forward_kinematics(K)
    motion(K)
    dynamics(K)
    servo.wanted(K, S)
    a = 400.0 * (S.q[:7] - q) + 40.0 * (S.v[:7] - v)
    assert S.a[:7] == pytest.approx(a)
    full = servo.ask(K, S)
    inertia, expected = robot.mass_matrix(q), robot.bias(q, v)
    for i in range(7):
        expected[i] += sum(inertia[i, j] * a[j] for j in range(7) if i == j or j in obeys)
    assert S.tau[:7] == pytest.approx(np.clip(expected, -S.limit[:7], S.limit[:7]))
    assert S.demand[:7] == pytest.approx(np.clip(expected, -S.tau_max[:7], S.tau_max[:7]))
    assert full == (np.abs(expected[obeys]) > robot.limits.tau_max[obeys]).any()
    S.limit[:7] = 0.0
    alone = robot.bias(q, v)[0] + inertia[0, 0] * a[0]
    S.limit[0] = 0.5 * abs(alone)
    assert servo.ask(K, S) == 1, "a motor that has lost half of what it needs is full"
    assert not S.tau[1:7].any() and S.tau[0] == pytest.approx(0.5 * alone) and S.demand[3] != 0.0
    S.limit[0] = 1.1 * abs(alone)
    assert servo.ask(K, S) == 0


def record(**kinds):
    """A torque arm of four joints at rest; some have failed, by their codes."""
    K = empty_record()
    K.chain.n, K.state.dt = N, 0.01
    feedback, faults = K.feedback, K.faults
    feedback.kind, feedback.active, feedback.stiffness = DriveKind.TORQUE, 1, 20.0
    feedback.span, feedback.now = 4, 1
    feedback.M[:N, :N], feedback.h[:N] = M, [1.0, -2.0, 3.0, -4.0]
    K.limits.tau_max[:N], K.limits.v_max[:N] = 1e3, 2.0
    faults.code[:N] = HEALTHY
    for name, code in kinds.items():
        faults.code[int(name[1:])] = code
    free = [i for i in range(N) if faults.code[i] == FREE]
    locked = [i for i in range(N) if faults.code[i] == LOCKED]
    working = [i for i in range(N) if i not in free and i not in locked]
    faults.order[:N] = [*working, *free, *locked]
    faults.working, faults.movable = len(working), len(working) + len(free)
    K.state.a_command[working] = 0.3 * rng.normal(size=len(working))
    return K, working


def feedback_of(K, working, most=np.inf):
    """w^2 (q_r - q^) + 2 w (v_r - v^), within the share of the torque limit."""
    a = K.state.a_command[:N].copy()
    w = K.feedback.stiffness
    back = w * w * (K.state.q[:N] - K.feedback.q_now[:N]) + 2.0 * w * (K.state.v[:N] - K.feedback.v_now[:N])
    limit = 0.6 * K.limits.tau_max[:N] / np.diag(M)
    a[working] += np.clip(back, -limit, limit)[working]
    return a


def test_torques_are_those_of_the_model_with_feedback_and_what_the_observer_feeds_forward():
    K, working = record()
    K.state.q[:N], K.state.v[:N] = 0.01 * rng.normal(size=(2, N))
    K.feedback.d_slow[:N] = 0.1 * rng.normal(size=N)
    a = feedback_of(K, working)
    sent.send(K)
    forward = -M @ K.feedback.d_slow[:N]
    assert K.feedback.tau_sent[:N] == pytest.approx(M @ a + K.feedback.h[:N] + forward)
    assert K.past.a[1, :N] == pytest.approx(a + np.linalg.solve(M, forward)), "what the model makes of it"
    K.feedback.bad[2] = 1
    bad = feedback_of(K, [0, 1, 3])
    sent.send(K)
    assert K.feedback.tau_sent[:N] == pytest.approx(M @ bad + K.feedback.h[:N] + forward)


@pytest.mark.parametrize("free", [[1], [0, 2]])
@pytest.mark.parametrize("contact", [False, True])
def test_beside_a_joint_that_swings_freely_the_others_reckon_with_what_it_does(free, contact):
    K, working = record(**{f"j{i}": FREE for i in free})
    K.faults.friction[free], K.chain.viscous[:N] = 0.7, 0.2
    K.feedback.v_now[:N], K.state.v[:N] = 0.1, 0.1
    K.state.q[:N] = 0.01 * rng.normal(size=N)
    d = K.feedback.d_slow[:N]
    d[:] = 0.2 * rng.normal(size=N)
    given = d.copy()
    K.free.contact[free[-1]] = int(contact)
    a = feedback_of(K, working)
    sent.send(K)
    for k, i in enumerate(free):
        stands = contact and i == free[-1]
        known = [j for j in range(N) if j != i and (j in working or j in free[:k])]
        total = -K.feedback.h[i] - 0.7 * 0.1 - M[i, known] @ a[known]
        later = [j for j in free if j not in free[: k + 1]]
        total -= M[i, later] @ K.state.a_command[later]
        a[i] = 0.0 if stands else total / (M[i, i] + 0.01 * 0.9)
        assert d[i] == pytest.approx(0.0 if stands else -M[i, working] @ given[working] / M[i, i])
    forward = -M @ d
    expected = M @ a + K.feedback.h[:N] + forward
    assert K.feedback.tau_sent[working] == pytest.approx(expected[working])
    assert not K.feedback.tau_sent[free].any(), "a motor that has failed gets nothing"


def test_a_joint_whose_brake_slips_is_reckoned_to_give_way_to_the_feedback():
    for speed, slips in ((0.2, True), (0.05, False)):
        K, working = record(j3=LOCKED)
        K.state.q[:N] = 0.02 * rng.normal(size=N)
        K.feedback.v_hat[3] = speed
        a = feedback_of(K, working)
        if slips:
            a[3] = -M[3, working] @ (a - K.state.a_command[:N])[working] / M[3, 3]
        sent.send(K)
        assert K.feedback.tau_sent[working] == pytest.approx((M @ a + K.feedback.h[:N])[working])


def test_motors_at_their_limits_get_less_and_the_others_know_of_it():
    """Every torque is within its limit, and the others give what the accelerations that come about take."""
    K, working = record()
    K.feedback.d_slow[:N] = 0.1 * rng.normal(size=N)
    a = feedback_of(K, working)
    tau = M @ a + K.feedback.h[:N] - M @ K.feedback.d_slow[:N]
    most = np.abs(tau) * [0.6, 2.0, 0.7, 2.0]
    K.limits.tau_max[:N] = most
    forward = np.clip(-M @ K.feedback.d_slow[:N], -0.3 * most, 0.3 * most)
    sent.send(K)
    found = K.feedback.tau_sent[:N]
    assert (np.abs(found) <= most + 1e-9).all()
    full = np.abs(found) > most - 1e-9
    assert full[0] or full[2]
    came = np.linalg.solve(M, found - K.feedback.h[:N])
    assert K.past.a[1, :N] == pytest.approx(came), "the observer is told what the model makes of it"
    kept = came - np.linalg.solve(M, forward)
    assert kept[~full] == pytest.approx(a[~full]), "those that are not full do what is wanted"


def test_a_velocity_arm_is_held_with_an_integral_and_within_its_limits():
    K, _ = record(j2=LOCKED)
    K.feedback.kind, K.feedback.hold, K.feedback.latency = DriveKind.VELOCITY, 8.0, 0
    K.state.v_command[:N] = [0.5, -0.5, 0.0, 1.99]
    K.past.q[1, :N], K.feedback.q_hat[:N] = 0.02, [0.0, 0.0, 0.5, 0.0]
    K.feedback.bad[1] = 1
    sent.send(K)
    wound = 0.125 * 64.0 * 0.01 * 0.02
    v = K.feedback.v_sent[:N]
    assert v[0] == pytest.approx(0.5 + 0.16 + wound) and v[1] == -0.5 and v[2] == 0.0 and v[3] == 2.0
    for _ in range(2000):
        sent.send(K)
    assert K.feedback.wound[0] == pytest.approx(0.1 * 2.0) and v[0] == pytest.approx(0.5 + 0.16 + 0.2)


def test_a_position_arm_gets_a_lead_and_an_arm_that_is_not_fed_back_its_command():
    K, _ = record(j2=LOCKED)
    K.state.q_command[:N], K.state.v_command[:N] = rng.normal(size=(2, N))
    K.feedback.kind, K.gate.lead = DriveKind.POSITION, 0.03
    K.limits.q_min[:N], K.limits.q_max[:N] = -10.0, 10.0
    K.feedback.active = 0
    sent.send(K)
    assert (K.feedback.q_sent[:N] == K.state.q_command[:N]).all()
    K.feedback.active = 1
    sent.send(K)
    lead = np.array([0.03, 0.03, 0.0, 0.03])
    wanted = K.state.q_command[:N] + lead * K.state.v_command[:N]
    assert K.feedback.q_sent[:N] == pytest.approx(wanted)
    assert K.feedback.v_sent[:N] == pytest.approx(K.state.v_command[:N] + lead * K.state.a_command[:N])
    top = K.limits.q_max[0] = K.state.q_command[0] + 0.5 * (wanted[0] - K.state.q_command[0])
    inside = min(top, wanted[0]) if wanted[0] > K.state.q_command[0] else wanted[0]
    sent.send(K)
    assert K.feedback.q_sent[0] == pytest.approx(inside)


def test_without_an_inertia_that_can_be_solved_nothing_is_shared():
    K, _ = record()
    K.feedback.M[:N, :N] = -np.eye(N)
    K.limits.tau_max[:N] = 0.5
    sent.send(K)
    assert (np.abs(K.feedback.tau_sent[:N]) <= 0.5).all() and np.isfinite(K.past.a[1, :N]).all()
