"""The detector's formulas one by one, against numpy and pinocchio."""

import numpy as np
import pinocchio as pin
import pytest
from failing_arm import DT, TAU_MAX, arm, detector

from ftqp.kernel.detection import carried, culprit, effort, fault_isolation, torque_share
from ftqp.kernel.detection.standing import FEWEST
from ftqp.kernel.layout.enums import (
    ACCELERATION_SLOW,
    IS_DEGRADED,
    IS_FREE,
    IS_FROZEN,
    IS_LOCKED,
    MOTOR_SLOW,
    OWN_SLOW,
    TORQUE_SLOW,
)

N = 3


@pytest.fixture
def rooms():
    """A detector's record and that of its arm, of an arm in motion, and the numbers that they were given."""
    watch, rng = detector("torque"), np.random.default_rng(3)
    D, K = watch._session.D, watch._session._arm.view(np.recarray)[0]
    D.seen[:N] = rng.uniform(-1.0, 1.0, N)
    D.past_v[0, :N], D.past_a[0, :N], D.w[1, :N] = rng.normal(size=(3, N))
    effort.feel_arm(D, K, 0)
    return D, K, rng


@pytest.mark.parametrize("moves", [True, False])
def test_an_unknown_load_takes_what_a_mass_there_takes(rooms, moves):
    """Y (m, m c) against pinocchio: the torques of the arm with a point mass less those without.

    The first moments leave out what the load takes by turning itself, so that they are compared at rest.
    """
    D, K, rng = rooms
    if not moves:
        D.past_v[:], D.past_a[:], D.w[:], D.has_dynamics = 0.0, 0.0, 0.0, 0
        effort.feel_arm(D, K, 0)
    D.d[0, :N] = rng.normal(size=N)
    carried.weigh(D, K, 0)
    robot = arm()
    q, v, a = D.seen[:N].copy(), D.past_v[0, :N] + D.w[1, :N], D.past_a[0, :N].copy()
    placement = pin.SE3(robot.chain.tip_rotation, robot.chain.tip_translation)

    def torques(mass, centre=(0.0, 0.0, 0.0)):
        model = robot.model.copy()
        if mass:
            point = pin.Inertia(mass, np.array(centre), np.zeros((3, 3)))
            model.appendBodyToJoint(model.njoints - 1, point, placement)
        data = model.createData()
        return np.array([pin.rnea(model, data, q, v, a), pin.crba(model, data, q) @ D.d[0, :N]])

    pull, jolt = torques(1.0) - torques(0.0)
    assert np.allclose(D.pull[0, :N], pull, atol=1e-9) and np.allclose(D.jolt[0, :N], jolt, atol=1e-9)
    J, R = robot.jacobian(q), robot.pose(q)[:3, :3]
    for k in range(3):
        at = 1e-6 * np.eye(3)[k]
        moment = (torques(1.0, at)[0] - torques(1.0, -at)[0]) / 2e-6
        assert moves or np.allclose(D.pull[1 + k, :N], moment, atol=1e-6)
        assert np.allclose(D.jolt[1 + k, :N], J[3:].T @ np.cross(R[:, k], J[:3] @ D.d[0, :N]), atol=1e-12)


def test_the_load_is_that_of_least_squares_of_what_is_seen(rooms):
    """With each joint's residual weighed by its mean square; blind joints say nothing."""
    D, _, rng = rooms
    D.ticks, D.finest[:N], D.load_fade = 8, 1e-4, 1.0
    carried.begin_load(D)
    assert D.spread[:N] == pytest.approx(1e-2)
    D.blind[1] = 1
    A, b = np.diag([1.0, 100.0, 100.0, 100.0]), np.zeros(4)
    for _ in range(12):
        D.strain[:, :N], D.x[TORQUE_SLOW, :N] = rng.normal(size=(4, N)), rng.normal(size=N)
        y = -D.x[TORQUE_SLOW, :N] + D.strain[:, :N].T @ D.load
        carried.learn_load(D)
        for i in (0, 2):
            trust = 1.0 / (carried.ALIKE * D.spread[i] + D.finest[i])
            A += trust * np.outer(D.strain[:, i], D.strain[:, i])
            b += trust * y[i] * D.strain[:, i]
        assert np.allclose(D.load, np.linalg.solve(A, b), rtol=1e-9)
    assert D.spread[1] == pytest.approx(1e-2)
    before = D.load.copy()
    D.ticks = 9
    carried.learn_load(D)
    assert np.array_equal(D.load, before), "between two estimates it stays"


def test_a_sum_that_cannot_be_solved_leaves_the_load_as_it_is(rooms):
    D, _, _ = rooms
    carried.begin_load(D)
    D.ticks, D.blind[:N], D.load[:] = 8, 1, 0.25
    D.load_square[0, 0] = -5.0
    carried.learn_load(D)
    assert D.load.tolist() == [0.25] * 4


def test_what_a_load_makes_of_the_residuals_is_filtered_as_they_are(rooms):
    """strain = F[pull] + jolt less its mean; F three one-pole filters."""
    D, _, rng = rooms
    carried.begin_load(D)
    D.load[:], D.at, p = [0.5, 0.1, -0.2, 0.3], 7, D.pole[0]
    state, mean = np.zeros((3, 4, N)), np.zeros((4, N))
    D.kept_pull[:] = 0.0
    for share in (0.0, 0.5, 0.25):
        D.pull[:, :N], D.jolt[:, :N] = rng.normal(size=(2, 4, N))
        x = D.pull[:, :N]
        for k in range(3):
            x = state[k] = p * state[k] + (1.0 - p) * x
        drawn = x + D.jolt[:, :N]
        mean += share * (drawn - mean)
        found = carried.feel_load(D, 0, 7, share)
        assert np.allclose(D.strain[:, :N], drawn - mean)
        assert np.allclose(np.asarray(found)[:N], D.load @ (drawn - mean))


def inertia(K):
    """M of the arm, (n, n)."""
    M = K.kinematics.M[:N, :N]
    return np.tril(M) + np.tril(M, -1).T


@pytest.mark.parametrize("of_torque", [True, False])
@pytest.mark.parametrize("blind", [None, 0, 2])
@pytest.mark.parametrize("bank", [0, 1])
def test_the_culprit_is_who_explains_most_of_all_that_moves(rooms, of_torque, blind, bank):
    D, K, rng = rooms
    assert culprit.factor_inertia(D, K)
    D.sharp[:] = rng.uniform(0.5, 2.0, D.sharp.shape)
    seen = [i for i in range(N) if i != blind]
    if blind is not None:
        D.blind[blind] = 1
    kind = TORQUE_SLOW if of_torque else ACCELERATION_SLOW
    D.excess[:] = 0.0
    D.excess[kind + bank, seen[0]] = 100.0  # the louder bank
    D.x[TORQUE_SLOW : TORQUE_SLOW + 2, :N], D.d[:, :N] = rng.normal(size=(2, 2, N))
    weights = D.sharp[ACCELERATION_SLOW + bank, :N]
    if of_torque:
        r = D.x[TORQUE_SLOW + bank, :N].copy()
        r[[i for i in range(N) if i not in seen]] = 0.0
        y = weights * np.linalg.solve(inertia(K), r)
    else:
        y = weights * D.d[bank, :N]
    y, U = y[seen], (weights[:, None] * np.linalg.inv(inertia(K)))[seen]
    expected = np.zeros(N)
    for at, j in enumerate(seen):
        u = U[:, j]
        if of_torque:
            expected[j] = (u @ y) ** 2 / (u @ u) / (y @ y)
        else:
            rest, others = np.delete(u, at), np.delete(y, at)
            expected[j] = (y[at] ** 2 + (rest @ others) ** 2 / (rest @ rest)) / (y @ y)
    joint, loud = culprit.by_direction(D, of_torque)
    assert np.allclose(D.score[:N], expected) and D.score[joint] == pytest.approx(expected.max())
    assert loud == (y @ y > 1.0)


def test_the_culprit_by_torque_is_who_is_oddest_beside_what_the_others_leak(rooms):
    D, K, rng = rooms
    for seed in range(20):
        rng = np.random.default_rng(seed)
        D.excess[TORQUE_SLOW : TORQUE_SLOW + 2, :N] = rng.uniform(0.0, 2.0, (2, N))
        D.room[TORQUE_SLOW : TORQUE_SLOW + 2, :N] = rng.uniform(1.0, 2.0, (2, N))
        D.d[:, :N] = rng.normal(size=(2, N))
        D.blind[:N] = 0
        D.blind[rng.integers(N)] = seed % 2
        M = inertia(K)
        leak = 0.1 * (np.abs(D.d[:, :N]) @ np.abs(M - np.diag(np.diag(M))))
        room, size = D.room[TORQUE_SLOW : TORQUE_SLOW + 2, :N], D.excess[TORQUE_SLOW : TORQUE_SLOW + 2, :N]
        odd = (size / np.hypot(room, leak)).max(axis=0)
        odd[D.blind[:N] != 0] = 0.0
        assert culprit.by_torque(D, K) == (np.argmax(odd) if odd.max() > 0.5 else -1)
    D.excess[:] = 0.0
    assert culprit.by_torque(D, K) == -1


def test_quiet_motion_leaves_the_culprit_to_the_torques_and_no_inertia_to_nobody(rooms):
    D, K, _ = rooms
    D.has_effort, D.known, D.asked = 1, 1, 0
    D.excess[:], D.x[:], D.d[:] = 0.0, 0.0, 0.0
    D.room[:], D.sharp[:] = 1.0, 1.0
    D.excess[TORQUE_SLOW, 2] = 5.0
    D.d[0, 1] = 0.9
    assert culprit.culprit(D, K) == 2
    D.d[0, 1] = 50.0
    assert culprit.culprit(D, K) == 1, "what is beyond its rooms moves"
    D.d[0, 1], D.excess[TORQUE_SLOW, 2] = 0.9, 0.0
    assert culprit.culprit(D, K) == 1, "and so where no torque is odd"
    D.has_effort = 0
    D.excess[TORQUE_SLOW, 2] = 5.0
    assert culprit.culprit(D, K) == 1
    K.kinematics.M[:N, :N] = -np.eye(N)
    assert culprit.culprit(D, K) == -1


def standing(rooms, load, friction, residual, *, patience=0, noise=(1e-5, 0.0), same=0):
    """What is said of joint 1, which stands under a load."""
    D, K, _ = rooms
    D.has_effort = D.asked = 1
    D.past_a[0, :N], D.coulomb[1] = 0.0, friction
    K.kinematics.h[1], D.x[TORQUE_SLOW, 1] = load, residual
    D.patience, D.watch = patience, 10
    (D.sigma, D.quantum), D.same[1], D.travel[1] = noise, same, 1.0
    return fault_isolation._held(D, K, 1, 0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_a_joint_that_stands_may_be(rooms, sign):
    """A free one would fall under the load, a degraded one would overcome friction, a frozen one repeats."""
    held = fault_isolation.HELD
    assert standing(rooms, sign * 20.0, 0.0, 0.0) == IS_LOCKED
    assert standing(rooms, sign * 20.0, 1.0, -sign * 400.0) == IS_LOCKED, "the loop pushes hard"
    assert standing(rooms, sign * 0.99 * held, 0.0, 0.0) == IS_LOCKED + IS_FREE
    assert standing(rooms, sign * 1.01 * held, 0.0, 0.0) == IS_LOCKED
    assert standing(rooms, sign * (2.0 + 0.99 * held), 1.0, -sign * 50.0) == IS_LOCKED + IS_FREE
    assert standing(rooms, sign * 20.0, 1.0, 0.0) == IS_LOCKED + IS_DEGRADED, "20 is below twice 20 + 1"
    assert standing(rooms, sign * 20.0, 1.0, 0.0, patience=6) == 0, "not before its patience is over"
    assert standing(rooms, sign * 20.0, 1.0, 0.0, patience=5) == IS_LOCKED + IS_DEGRADED
    assert standing(rooms, sign * 20.0, 1.0, sign * 21.9) == IS_LOCKED + IS_DEGRADED, "1.9 the other way"
    assert standing(rooms, sign * 20.0, 1.0, sign * 22.1) == IS_LOCKED
    coarse = (1e-5, 1e-4)
    assert standing(rooms, sign * 20.0, 0.0, 0.0, noise=coarse, same=4) == IS_LOCKED + IS_FROZEN
    assert standing(rooms, sign * 20.0, 0.0, 0.0, noise=coarse, same=3) == IS_LOCKED
    assert standing(rooms, sign * 20.0, 0.0, 0.0, same=9) == IS_LOCKED, "finer than its noise"


def test_how_much_a_joint_stands_out_is_by_the_torque_that_is_known(rooms):
    D, _, _ = rooms
    D.excess[:], D.sharp[:], D.deviation[1] = 0.0, 2.0, 7.0
    D.excess[MOTOR_SLOW + 1, 1], D.excess[TORQUE_SLOW, 1], D.excess[OWN_SLOW + 1, 1] = 1.0, 3.0, 4.0
    for effort_, known, motor, expected in (
        (0, 0, 0, 7.0),
        (1, 0, 0, 7.0),
        (1, 1, 0, 8.0),
        (1, 1, 1, 2.0 / 0.67),
    ):
        D.has_effort, D.known, D.has_motor = effort_, known, motor
        assert fault_isolation._shown(D, 1) == pytest.approx(expected)


def fitted(rooms, share, *, spread=0.9, size=50.0, unsure=0.05, watch=100, coulomb=0.0, asked=1, room=0.01):
    """The verdict on a share of the torque of joint 1 that was fitted."""
    D, K, _ = rooms
    D.has_effort = D.known = 1
    D.asked, D.watch, D.patience, D.coulomb[1], D.has_motor = asked, watch, 20, coulomb, 0
    D.room[TORQUE_SLOW, 1], D.excess[:], D.sharp[:], D.excess[TORQUE_SLOW, 1] = room, 0.0, 1.0, 1.5
    D.kept[:, 1] = 0.6 * DT * np.arange(len(D.kept))  # it moves
    D.kept_v[:, 1], D.at = 0.6, len(D.kept) - 1

    def fit(D, K, i, then):
        D.fit_share, D.fit_spread, D.fit_size, D.fit_best = share, spread, size, 0
        D.fit_gg[0] = (fault_isolation.UNSURE / unsure) ** 2

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fault_isolation, "fit_share", fit)
        return fault_isolation._lost_torque(D, K, 1, 0)


def test_the_share_says_whether_torque_is_lost_or_all_of_it(rooms):
    assert fitted(rooms, 0.5) == IS_DEGRADED and fitted(rooms, 0.0) == IS_FREE
    assert fitted(rooms, 0.33) == IS_DEGRADED and fitted(rooms, 0.21) == IS_FREE
    assert fitted(rooms, 0.30) == IS_FREE + IS_DEGRADED, "within what is unsure of nothing left"
    assert fitted(rooms, 0.30, watch=59) == 0, "and that it is not clear is not said too soon"
    assert fitted(rooms, 0.30, watch=60) == IS_FREE + IS_DEGRADED
    assert fitted(rooms, 0.5, watch=19) == 0 and fitted(rooms, 0.5, watch=20) == IS_DEGRADED
    for share, asked, expected in ((0.86, 1, 0), (0.84, 1, IS_DEGRADED), (-0.26, 1, 0), (-0.26, 0, IS_FREE),
                                   (-0.61, 0, 0)):  # fmt: skip
        assert fitted(rooms, share, asked=asked) == expected, (share, asked)
    assert fitted(rooms, 0.5, spread=0.59) == 0
    assert fitted(rooms, 0.5, size=1.9, coulomb=1.0) == 0, "friction holds it whatever it gives"
    assert fitted(rooms, 0.5, size=2.1, coulomb=1.0) == IS_DEGRADED
    assert fitted(rooms, 0.5, size=2.1, coulomb=1.0, room=0.6) == IS_FREE + IS_DEGRADED, "faint"


def test_the_share_that_is_fitted_is_that_of_the_demand_since_its_onset(rooms):
    """A motor that gives 0.4 of a demand from 8 ticks ago on, seen through the filter of the observers."""
    D, K, rng = rooms
    D.has_motor, D.asked, D.at, D.fitted = 1, 1, 20, -1
    demand = 20.0 + rng.normal(size=60).cumsum()
    onset, share = 13, 0.4
    D.room[:], D.kept_effort[:21, 1] = 1.0, demand[:21]
    lost, seen = np.zeros((2, 3)), []
    for k in range(60):
        x = [(share - 1.0) * demand[k] * (k >= onset)] * 2
        for b in range(2):
            for s in range(3):
                lost[b, s] = D.pole[b] * lost[b, s] + (1.0 - D.pole[b]) * (x[b])
                x[b] = lost[b, s]
        seen.append(lost[:, 2].copy())
    for k in range(21, 60):
        D.at, D.motor_torque[1] = k, demand[k]
        D.kept_effort[k, 1] = demand[k]
        D.x[MOTOR_SLOW : MOTOR_SLOW + 2, 1] = seen[k]
        torque_share.fit_share(D, K, 1, 0)
    assert D.fit_share == pytest.approx(share, abs=1e-9) and D.fit_onset == 8.0
    assert D.fit_spread == pytest.approx(1.0) and D.fit_size == demand[59]


def test_a_fit_without_any_demand_shows_nothing(rooms):
    D, K, _ = rooms
    D.has_motor, D.asked, D.fitted, D.kept_effort[:], D.motor_torque[:], D.x[:] = 1, 1, -1, 0.0, 0.0, 0.0
    torque_share.fit_share(D, K, 1, 0)
    assert (D.fit_share, D.fit_spread) == (1.0, 0.0)


@pytest.mark.parametrize("way", ["beyond", "against"])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_runaway_goes_where_nobody_sent_it_with_torque_that_came_at_once(rooms, way, side):
    """Faster than its reference by 0.15 rad/s, with 45 % of its torque, 25 % of which jumped."""
    D, K, _ = rooms
    D.has_motor, D.watch = 0, 100
    K.kinematics.M[:N, :N], K.kinematics.h[:N], D.past_a[0, :N] = np.eye(N), 0.0, 0.0

    def runs(beyond, jump, load=0.0, v_ref=0.3):
        v_ref = v_ref if way == "beyond" else -v_ref
        v = beyond + (v_ref if way == "beyond" else 0.0)
        D.past_v[0, 1], D.d[1, 1], K.kinematics.h[1] = side * v_ref, side * jump, side * load
        D.kept[:, 1], D.at = side * v * DT * np.arange(len(D.kept)), len(D.kept) - 1
        return bool(fault_isolation._runs_away(D, K, 1, 0))

    full = TAU_MAX[1]
    assert runs(0.16, 0.5 * full) and not runs(0.14, 0.5 * full)
    assert not runs(0.16, 0.44 * full) and runs(0.16, 0.44 * full, load=0.02 * full)
    assert not runs(0.16, 0.24 * full, load=0.5 * full) and runs(0.16, 0.26 * full, load=0.5 * full)
    assert not runs(0.16, -0.5 * full), "torque against its way does not drive it"
    assert not runs(0.16, 0.3 * full, load=-full), "and what is left of it has to be along its way"


def test_no_joint_is_named_where_none_explains_anything(rooms):
    D, K, _ = rooms
    D.blind[:N], D.z[:N], D.worst = 1, 0.0, 0.0
    assert fault_isolation.isolate_fault(D, K, 0) == (-1, 0)
    assert D.suspect == -1 and FEWEST == 16
