"""Where an unaware arm rests: the linearisation there, single rests and their curves."""

import numpy as np
import pytest
from tests.analysis.planar_arms import links, telescope

from ftqp.analysis import outcome, reachable_after
from ftqp.analysis.goals import goal_study
from ftqp.analysis.manifolds.joint_ranges import joint_ranges
from ftqp.analysis.rest.linearisation import (
    RestKind,
    convergence_rates,
    reduced_jacobians,
    rest_test,
    weighted_inverse,
)
from ftqp.analysis.rest.rest_curves import rest_configurations, rest_curves
from ftqp.analysis.rest.rest_tracing import RestEquations
from ftqp.core.checks import FloatArray
from ftqp.model import catalog
from ftqp.model.robot import Robot

STEP = 1e-6


def weights(rng: np.random.Generator, n: int) -> FloatArray:
    B = rng.normal(size=(n, n))
    return np.asarray(B @ B.T + 0.5 * np.eye(n))


def arms() -> list[tuple[Robot, str]]:
    return [
        (links(1, 1, 1), "position"),
        (links(1, 0.7, 0.9, 0.4), "position"),
        (catalog.load("panda"), "pose"),
    ]


@pytest.mark.parametrize("which", range(3))
def test_linearisation_is_that_of_central_differences(which: int) -> None:
    robot, rows = arms()[which]
    rng = np.random.default_rng(which)
    n = robot.nv
    q = robot.neutral + rng.uniform(-0.4, 0.4, n)
    study = goal_study(robot, robot.pose(robot.neutral), rows)
    M = np.linalg.inv(weights(rng, n))

    def command(p: FloatArray) -> FloatArray:
        e, A, _, _ = study.free.values(p[None])
        return np.asarray(weighted_inverse(A[0], M) @ e[0])

    rates = np.column_stack([(command(q + d) - command(q - d)) / (2.0 * STEP) for d in STEP * np.eye(n)])
    for locked in ([0], [n - 1], [0, 1]):
        found = reduced_jacobians(study, M, q[None], locked)[0]
        expected = np.delete(np.delete(rates, locked, 0), locked, 1)
        assert found == pytest.approx(expected, abs=1e-7 * np.abs(rates).max())


@pytest.mark.parametrize("which", range(3))
def test_eigenvalues_at_the_goal_are_minus_one_zero_and_minus_rho(which: int) -> None:
    robot, rows = arms()[which]
    rng = np.random.default_rng(which)
    n = robot.nv
    q = robot.neutral + rng.uniform(-0.4, 0.4, n)
    study = goal_study(robot, robot.pose(q), rows)
    for W in (np.eye(n), weights(rng, n)):
        rho = convergence_rates(robot, q, rows, W)
        for i, joint in enumerate(robot.joints):
            found = reduced_jacobians(study, np.linalg.inv(W), q[None], [i])[0]
            expected = [-1.0] * (study.m - 1) + [0.0] * (study.redundancy - 1) + [-rho[joint]]
            assert np.sort(np.linalg.eigvals(found).real) == pytest.approx(np.sort(expected), abs=1e-10)


def test_rate_without_weights_is_the_squared_relative_manipulability() -> None:
    robot = catalog.load("panda")
    J = robot.jacobian(robot.neutral)[:3]
    for i, rho in enumerate(convergence_rates(robot, robot.neutral).values()):
        left = np.delete(J, i, axis=1)
        assert rho == pytest.approx(np.linalg.det(left @ left.T) / np.linalg.det(J @ J.T), abs=1e-10)


def test_weights_that_are_not_diagonal_can_make_the_goal_repel() -> None:
    robot, q = links(1, 1, 1), np.array([0.3, 0.9, 0.02])
    W = np.eye(3)
    W[1, 2] = W[2, 1] = 0.9
    assert min(convergence_rates(robot, q).values()) >= 0.0
    assert convergence_rates(robot, q, W=W)["j2"] < -0.5


@pytest.mark.parametrize("name", ["planar", "panda"])
def test_derivative_is_that_of_central_differences(name: str) -> None:
    robot = links(1, 1, 1, 1) if name == "planar" else catalog.load("panda")
    rng = np.random.default_rng(1)
    study = goal_study(robot, robot.pose(robot.neutral), "pose")
    B = rng.normal(size=(robot.nv, robot.nv))
    equations = RestEquations(study, B @ B.T + np.eye(robot.nv), 2)
    z = equations.started(robot.neutral + rng.uniform(-0.3, 0.3, (1, robot.nv)))
    z = z + rng.normal(scale=0.1, size=z.shape)
    d = equations.values(z)[1][0]
    step = 1e-6
    pairs = [
        (equations.values(z + step * h)[0], equations.values(z - step * h)[0]) for h in np.eye(equations.size)
    ]
    rates = np.column_stack([(up - down)[0] / (2.0 * step) for up, down in pairs])
    assert d == pytest.approx(rates, abs=1e-8)


def test_one_lock_rests_just_where_error_and_rank_say_so() -> None:
    robot = links(1, 0.8, 0.6)
    rng = np.random.default_rng(4)
    for _ in range(20):
        B = rng.normal(size=(3, 3))
        W = B @ B.T + 0.3 * np.eye(3)
        goal = rng.uniform(-1.5, 1.5, 2)
        joint = int(rng.integers(3))
        for rest in rest_configurations(robot, goal, joint, float(rng.uniform(-3.0, 3.0)), W):
            found = rest_test(robot, rest.q, [joint], goal, W)
            assert found.passes()
            assert max(found.collinear, found.rank) < 1e-8
        found = rest_test(robot, rng.uniform(-3.0, 3.0, 3), [joint], goal, W)
        assert not found.passes()
        assert max(found.collinear, found.rank) > 1e-6


def test_several_locks_need_more_than_a_loss_of_rank() -> None:
    robot = links(1, 1, 1, 1)
    q = np.array([0.3, 0.5, 0.7, 0.0])
    x = robot.pose(q)[:2, 3]
    J = robot.jacobian(q)[:2]
    healthy = J[:, 2:]
    assert np.linalg.matrix_rank(healthy, tol=1e-9) == 1  # joints 3 and 4 in line with the tip
    left = np.linalg.svd(healthy)[0][:, 1]  # no healthy joint moves the tip along it
    resting = rest_test(robot, q, ["j1", "j2"], x + J[:, :2] @ (J[:, :2].T @ left))
    assert resting.rest < 1e-12
    other = rest_test(robot, q, ["j1", "j2"], x + 0.3 * J[:, 0])
    assert other.rank < 1e-12
    assert other.collinear < 1e-12
    assert other.rest > 1e-2


W = np.array([[1.0, 0.3, 0.0], [0.3, 2.0, -0.4], [0.0, -0.4, 0.7]])


@pytest.mark.parametrize("joint", ["j1", pytest.param("j3", marks=pytest.mark.slow)])
def test_rests_of_a_scan_are_on_the_curves_with_their_kind(joint: str) -> None:
    robot, goal = links(1, 0.8, 0.55), (1.1, 0.6)
    curves = rest_curves(robot, goal, joint, W)
    points = np.vstack([curve.q for curve in curves])
    kinds = np.array([kind for curve in curves for kind in curve.kinds])
    count = 0
    for value in np.linspace(-3.0, 3.0, 7):
        for rest in rest_configurations(robot, goal, joint, float(value), W):
            away = points - rest.q
            distance = np.linalg.norm(away - 2.0 * np.pi * np.round(away / (2.0 * np.pi)), axis=1)
            nearest = np.argsort(distance)[:3]
            assert distance[nearest[0]] < 0.05
            assert rest.kind in kinds[nearest]
            count += 1
    assert count > 7


def test_points_of_a_curve_rest() -> None:
    robot, goal = links(1, 1, 1, 1), (1.5, 1.5)
    curves = rest_curves(robot, goal, "j2")
    assert len(curves) > 0
    for curve in curves:
        tested = [rest_test(robot, q, ["j2"], goal) for q in curve.q[::25]]
        assert max(found.rest for found in tested if found.full_rank > 1e-3) < 1e-7


def test_sinks_within_reach_appear_with_a_long_second_link() -> None:
    robot, goal = links(1.0, 1.0, 0.4), (0.9, 0.3)
    inside = rest_curves(robot, goal, "j1").sink_intervals() & joint_ranges(robot, goal)["j1"]
    assert inside.size > 0.01
    low, high = max(inside.intervals, key=lambda pair: pair[1] - pair[0])
    rests = rest_configurations(robot, goal, "j1", 0.5 * (low + high))
    assert any(rest.kind is RestKind.SINK for rest in rests)


def test_sliding_joint_has_sinks_up_to_where_the_goal_comes_within_reach() -> None:
    robot, goal = telescope(), (1.0, 0.4)
    curves = rest_curves(robot, goal, "slide")
    ranges = joint_ranges(robot, goal)["slide"]
    reach = np.hypot(*goal) - 0.5
    assert ranges.intervals[0] == pytest.approx((reach, 1.5), abs=1e-9)
    assert curves.sink_intervals().intervals[0] == pytest.approx((0.2, reach), abs=1e-6)
    assert not curves.sink_intervals().circular


@pytest.mark.slow
def test_sinks_of_a_panda_end_where_rests_leave_its_limits() -> None:
    robot = catalog.load("panda")
    goal = robot.pose(robot.neutral)
    curves = rest_curves(robot, goal, "panda_joint2", rows="pose")
    sinks = curves.sink_intervals()
    assert sinks.intervals
    i = robot.joint("panda_joint2")
    assert all(
        low >= robot.limits.q_min[i] and high <= robot.limits.q_max[i] for low, high in sinks.intervals
    )
    middle = [0.5 * (low + high) for low, high in sinks.intervals]
    for value in middle:
        rests = rest_configurations(robot, goal, "panda_joint2", value, rows="pose")
        assert any(rest.kind is RestKind.SINK for rest in rests)


@pytest.mark.slow
def test_crossings_of_curves_are_flagged() -> None:
    curves = rest_curves(links(1, 1, 1), (1.5, 1.5), "j2")
    main, circle = sorted(curves, key=lambda curve: np.ptp(curve.q[:, 1]), reverse=True)
    shared = [
        q
        for q in main.branches
        if np.linalg.norm((circle.q - q + np.pi) % (2.0 * np.pi) - np.pi, axis=1).min() < 0.05
    ]
    assert len(shared) >= 4
    assert not any(len(curve.branches) for curve in rest_curves(links(1, 1, 1), (1.5, 1.5), "j1"))


def closed_form(lengths: tuple[float, float, float], x: tuple[float, float], joint: int, value: float) -> int:
    """How many rests three links have for a locked value: roots of A cos(phi - b) = C for both foldings."""
    l1, l2, l3 = lengths
    goal = complex(*x)
    count = 0
    for s in (1.0, -1.0):
        if joint == 0:
            o, d = l1 * np.exp(1j * value), l2 + s * l3
            amplitude = abs(d * (goal - 2.0 * o))
            constant = abs(o) ** 2 + d * d - (np.conj(o) * goal).real
        elif joint == 1:
            z = l1 + l2 * np.exp(1j * value)
            d, delta = abs(z) + s * l3, np.angle(z)
            amplitude = abs(goal) * abs(d - l1 * np.exp(-1j * delta))
            constant = d * d - d * l1 * np.cos(delta)
        else:
            z = l2 + l3 * np.exp(1j * value)
            d = l1 + s * abs(z)
            kappa = (0.0 if s > 0 else np.pi) - np.angle(z) + value
            amplitude, constant = abs(goal), d * np.cos(kappa)
        count += 2 if abs(constant) < amplitude else 0
    return count


@pytest.mark.parametrize("joint", range(3))
def test_grid_finds_all_rests_of_the_closed_form(joint: int) -> None:
    lengths, x = (1.0, 0.8, 0.55), (1.1, 0.6)
    robot = links(*lengths)
    total = 0
    for value in np.linspace(-3.1, 3.1, 10):
        found = rest_configurations(robot, x, joint, float(value))
        assert len(found) == closed_form(lengths, x, joint, float(value))
        total += len(found)
    assert total > 10


def test_joint_that_never_moves_the_tip_is_left_out() -> None:
    robot = catalog.load("panda").with_limits(q_min=-np.inf, q_max=np.inf)
    goal = (0.5, 0.1, 0.4)
    found = rest_configurations(robot, goal, "panda_joint2", 0.5)
    assert len(found) > 20
    for rest in found:
        assert rest.q[6] == pytest.approx(robot.neutral[6], abs=1e-12)
        assert len(rest.eigenvalues) == 5
        assert rest_test(robot, rest.q, "panda_joint2", goal).passes()
    assert {rest.kind for rest in found} <= {RestKind.SINK, RestKind.SADDLE, RestKind.SOURCE}
    assert rest_configurations(robot, goal, "panda_joint7", 0.5) == []


WEIGHTS = np.array([[1.0, 0.4, 0.0], [0.4, 1.5, -0.5], [0.0, -0.5, 0.8]])


@pytest.mark.slow
@pytest.mark.parametrize("weights", [None, WEIGHTS])
def test_simulated_arm_rests_off_its_goal_at_a_known_sink(weights: np.ndarray | None) -> None:
    robot, goal = links(1, 1, 0.7), (1.2, 0.9)
    rng = np.random.default_rng(3)
    sinks = {joint: rest_curves(robot, goal, joint, weights).sink_intervals() for joint in robot.joints}
    stopped = 0
    for _ in range(24):
        q, joint = rng.uniform(-np.pi, np.pi, 3), robot.joints[int(rng.integers(3))]
        value = float(q[robot.joint(joint)])
        found = outcome(robot, goal, q, locked=[joint], W=weights)
        if found.kind == "correct":
            assert reachable_after(robot, goal, {joint: value})
        if found.kind != "erroneous":
            continue
        rests = rest_configurations(robot, goal, joint, value, weights)
        ends = np.array([rest.q for rest in rests if rest.kind is RestKind.SINK])
        away = (ends - found.q + np.pi) % (2.0 * np.pi) - np.pi
        assert np.abs(away).max(axis=1).min() < 1e-5
        assert sinks[joint].contains(value)
        stopped += 1
    assert stopped > 4
