"""The metric of settling: where it is zero, and what it is made of where it is not."""

import numpy as np
import pytest
from session_ticks import Ticks

import ftqp
from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.arm.pose_error import pose_error
from ftqp.kernel.entry.session import Memory
from ftqp.kernel.feedback.status_report import task_error
from ftqp.kernel.rows.task_rows import task_rows
from ftqp.kernel.settling.curvature import curvature, spread, weigh_rows
from ftqp.kernel.settling.metric import find_metric, outlook
from ftqp.kernel.settling.settling_qp import set_in_at_zero
from ftqp.kernel.settling.trigger import curvature_bound, is_regular, largest_curvature


def record_of(robot, **settings):
    robot = ftqp.robots.load(robot) if isinstance(robot, str) else robot
    K, n = Ticks(robot, 0.002, torque_limits=False, **settings).K, robot.nv
    K.faults.order[:n], K.faults.working, K.faults.movable = np.arange(n), n, n
    return robot, K


def look(K, robot, q, pose):
    """Kinematics, error and rows at q."""
    K.state.q[: robot.nv] = q
    K.task.target[:] = ftqp.Target(pose=pose).packed
    forward_kinematics(K, K.state)
    pose_error(K)
    task_error(K.task, K.feedback, K.kinematics, K.past)
    task_rows(K, 1.0)


def weighed(K):
    """The square of the weighed rows, and the curvature."""
    square = weigh_rows(K.task, K.kinematics, K.chain, K.qp, K.settling)
    return square, curvature(K.faults, K.task, K.kinematics, K.chain, K.settling)


def near(robot, rng, size):
    """A posture and a target beside its tip."""
    q = np.clip(
        robot.neutral + rng.uniform(-0.6, 0.6, robot.nv), robot.limits.q_min + 0.2, robot.limits.q_max - 0.2
    )
    pose = robot.pose(q)
    pose[:3, 3] += rng.normal(size=3) * size
    return q, pose


def test_an_error_called_harmless_is():
    robot, K = record_of("panda")
    rng, regular = np.random.default_rng(1), 0
    q, pose = near(robot, rng, 1e-3)
    for _ in range(300):
        q = q + rng.uniform(-0.01, 0.01, 7)  # as a motion goes on, so that what was seen is used again
        if rng.random() < 0.05:
            q, _ = near(robot, rng, 1e-3)
        pose = robot.pose(q)
        pose[:3, 3] += rng.normal(size=3) * 10.0 ** rng.uniform(-5.0, -1.5)
        look(K, robot, q, pose)
        harmless = is_regular(K)
        regular += harmless
        _, s = weighed(K)
        assert not harmless or s < np.linalg.svd(K.settling.A[:6, :7], compute_uv=False)[-1] ** 2
    assert 50 < regular < 290


@pytest.mark.parametrize(
    "name", ["panda", "iiwa14", "planar(4)", pytest.param("modular11", marks=pytest.mark.slow)]
)
def test_bounds_on_the_curvature_hold_and_the_closer_one_is_close(name):
    robot, K = record_of(name)
    rng, ratios = np.random.default_rng(4), []
    for _ in range(100):
        q, pose = near(robot, rng, 10.0 ** rng.uniform(-4.0, -1.0))
        look(K, robot, q, pose)
        s, close, wide = (
            curvature(K.faults, K.task, K.kinematics, K.chain, K.settling),
            curvature_bound(K.task, K.kinematics, K.chain, K.settling),
            largest_curvature(K.task, K.kinematics, K.chain),
        )
        assert s <= close * (1.0 + 1e-12) and s <= wide * (1.0 + 1e-12)
        ratios.append(close / s)
    assert np.median(ratios) < 1.01


@pytest.mark.parametrize("name", ["panda", "iiwa14", "planar(4)"])
def test_rows_and_metric_together_are_convex_and_the_metric_is_zero_where_no_direction_is_lost(name):
    robot, K = record_of(name)
    n, m, rng = robot.nv, int(K.task.m), np.random.default_rng(2)
    kinds = set()
    for size in (1e-4, 3e-3, 0.03, 0.3, 1.0):
        for _ in range(20):
            q, pose = near(robot, rng, size)
            look(K, robot, q, pose)
            square, s = weighed(K)
            count = find_metric(K, s, square)
            A, D = K.settling.A[:m, :n], K.settling.D[:n, :n]
            sigma = np.linalg.svd(A[:, K.settling.free[: abs(count)]], compute_uv=False)[-1]
            kinds.add(count >= 0)
            largest = np.abs(np.linalg.eigvalsh(K.settling.S[:n, :n])).max()
            assert largest * (1.0 - 1e-9) <= spread(K.chain, K.settling) <= s * (1.0 + 1e-9)
            if count < 0:
                assert np.linalg.svd(A, compute_uv=False)[-1] ** 2 >= largest * (1.0 - 1e-9)
                continue
            assert sigma**2 < spread(K.chain, K.settling) * (1.0 + 1e-9)
            np.testing.assert_allclose(D, D.T, atol=1e-12 * s)
            assert np.linalg.eigvalsh(A.T @ A + D)[0] > -1e-9 * s
    assert kinds == {True, False}


def test_at_an_exact_singularity_the_modes_are_those_of_the_modulus_with_its_floor():
    robot, K = record_of("planar(4)")
    q = np.zeros(4)
    pose = robot.pose(q)
    pose[0, 3] += 0.2
    look(K, robot, q, pose)
    square, s = weighed(K)
    assert find_metric(K, s, square) == 4
    A, S = K.settling.A[:2, :4], K.settling.S[:4, :4]
    mu, Z = np.linalg.eigh(A.T @ A + S)
    modulus = A.T @ A + S  # S > 0 there: the target is beyond the stretched arm
    floors = [max(abs(x), 0.1 * z @ modulus @ z, 0.15 * s) for x, z in zip(mu, Z.T, strict=True)]
    v = A[1] / np.linalg.norm(A[1])
    phi = max(0.0, 1.0 - A[1] @ A[1] / s)
    T = np.eye(4) - (1.0 - np.sqrt(phi)) * np.outer(v, v)
    expected = T @ (Z @ np.diag(floors) @ Z.T - A.T @ A) @ T
    np.testing.assert_allclose(K.settling.D[:4, :4], expected, atol=1e-12)
    assert not K.settling.kick[:4].any()


def metric_by_formula(K, n, s, square):
    """D and the kick by eigenvalues of numpy (docs/theory/settling.md); which modes the floor raises."""
    m, count, settling = int(K.task.m), int(K.settling.found), K.settling
    A, S, e, free = settling.A[:m, :n], settling.S[:n, :n], settling.e[:m], np.sort(settling.free[:count])
    values, vectors = np.linalg.eigh(S)
    modulus = A.T @ A + vectors @ np.diag(np.abs(values)) @ vectors.T
    mu, Z = np.linalg.eigh((A.T @ A + S)[np.ix_(free, free)])
    size, along = np.abs(mu), Z.T @ (A.T @ e)[free]
    swivel = 0.15 * np.clip(1.0 - along**2 / (0.1 * size * square), 0.1, 1.0) * s
    floor = 0.1 * np.einsum("ik,ij,jk->k", Z, modulus[np.ix_(free, free)], Z)
    P, kick = modulus.copy(), np.zeros(n)
    P[free, :] = P[:, free] = 0.0
    P[np.ix_(free, free)] = Z @ np.diag(np.max([size, swivel, floor], axis=0)) @ Z.T
    _, sigma, V = np.linalg.svd(A[:, free])
    sigma = np.pad(sigma, (0, m - len(sigma)))
    phi = np.maximum(0.0, 1.0 - sigma**2 / s)
    u = np.linalg.svd(A[:, free])[0]
    if phi @ (u.T @ e) ** 2 >= 0.5 * square:
        saddle = (mu < -0.05 * s) & (np.abs(along) < 0.05 * size)
        kick[free] = Z @ np.where(saddle, np.sign(along) * 0.05 * size - along, 0.0)
    T = np.eye(n)
    for v, fade in zip(V[: min(m, count)], phi, strict=False):
        T[np.ix_(free, free)] -= (1.0 - np.sqrt(fade)) * np.outer(v, v)
    D = phi.max() * T @ (P - A.T @ A) @ T
    return D, phi.max() * T @ kick, floor > np.maximum(size, swivel)


@pytest.mark.parametrize("name", ["panda", "iiwa14", "planar(4)"])
def test_the_metric_is_that_of_the_modulus_with_its_floors(name):
    """Far targets, where S has both signs; in every other case a joint may be pressed on its limit."""
    robot, K = record_of(name)
    n, rng = robot.nv, np.random.default_rng(9)
    floored = indefinite = kicked = pressed = 0
    for case in range(80):
        q, pose = near(robot, rng, 0.7)
        if case % 2:
            q[1] = robot.limits.q_max[1]
        look(K, robot, q, pose)
        square, s = weighed(K)
        count = find_metric(K, s, square)
        if count <= 0:
            continue
        D, kick, raised = metric_by_formula(K, n, s, square)
        np.testing.assert_allclose(K.settling.D[:n, :n], D, atol=1e-9 * s)
        np.testing.assert_allclose(K.settling.kick[:n], kick, atol=1e-9 * s)
        signs = np.linalg.eigvalsh(K.settling.S[:n, :n])
        floored += bool(raised.any())
        indefinite += bool(signs[0] < -0.1 * s and signs[-1] > 0.1 * s)
        kicked, pressed = kicked + bool(kick.any()), pressed + (count < n)
    assert floored > 3 and indefinite > 10 and kicked and pressed


@pytest.mark.parametrize("name", ["panda", "iiwa14", "planar(4)"])
def test_the_metric_of_a_path_sets_in_at_zero(name):
    """It began with a part of itself, and ticks took turns."""
    robot, K = record_of(name)
    m, rng = int(K.task.m), np.random.default_rng(6)
    q, pose = near(robot, rng, 0.01)
    way = pose[:3, 3] - robot.pose(q)[:3, 3]
    low, high = 0.0, 1e3
    for _ in range(80):  # the least share of the way at which there is a metric
        share = 0.5 * (low + high)
        pose[:3, 3] = robot.pose(q)[:3, 3] + share * way
        look(K, robot, q, pose)
        square, s = weighed(K)
        count = find_metric(K, s, square)
        if count >= m:
            K.settling.count = count
            set_in_at_zero(K.faults, K.task, K.chain, K.settling)
        low, high, psi = (low, share, float(K.settling.psi)) if count >= m else (share, high, np.inf)
        if count >= m and high - low < 1e-9 * high:
            break
    assert psi < 1e-6 and np.abs(K.settling.D).max() < 1e-6 * s


SPEED = 0.05


def seen(name, q, way, speed=SPEED):
    """The path's room after a look from q along a twist, and the record."""
    robot, K = record_of(name)
    K.settling.on = 1
    path = Memory("path").fields
    path.speed = speed
    K.state.q[: robot.nv] = q
    K.task.target[:] = ftqp.Target(pose=robot.pose(q), twist=[*way, 0.0, 0.0, 0.0]).packed
    forward_kinematics(K, K.state)
    pose_error(K)
    task_rows(K, 1.0)
    error = K.task.error.copy()
    outlook(K, path)
    np.testing.assert_array_equal(K.task.error, error)
    return path, robot


STRETCHED = {
    "planar, stretched": ("planar(4)", np.zeros(4), (1.0, 0.0, 0.0)),
    "iiwa, straight": ("iiwa14", np.zeros(7), (0.0, 0.0, 1.0)),
    "srs7, straight": ("srs7", np.zeros(7), (0.0, 0.0, 1.0)),
}


@pytest.mark.parametrize("case", STRETCHED.values(), ids=STRETCHED)
def test_there_is_a_way_back_from_the_end_of_the_reach_and_none_beyond(case):
    name, q, out = case
    assert not seen(name, q, out)[0].found
    path, robot = seen(name, q, -np.array(out))
    assert path.found and path.driven
    way = path.drive[: robot.nv]
    assert np.abs(way).max() == pytest.approx(SPEED)
    for step in (way, -way):  # a self-motion to first order, along the path to second
        moved = robot.pose(q + 0.2 * step)[:3, 3] - robot.pose(q)[:3, 3]
        assert moved @ -np.array(out) > 1e-6 and np.linalg.norm(moved) < 0.01 * robot.length


STEP = 1e-4


def energy(K, q):
    n = int(K.chain.n)
    K.state.q[:n] = q
    forward_kinematics(K, K.state)
    pose_error(K)
    task_rows(K, 1.0)
    return 0.5 * weigh_rows(K.task, K.kinematics, K.chain, K.qp, K.settling)


def hessian(K, q):
    n = len(q)
    H = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            a, b = np.zeros(n), np.zeros(n)
            a[i] = b[j] = STEP
            H[i, j] = H[j, i] = (
                energy(K, q + a + b) - energy(K, q + a - b) - energy(K, q - a + b) + energy(K, q - a - b)
            ) / (4.0 * STEP * STEP)
    return H


def sliding_arm():
    """Six joints, two of which slide."""
    table = [
        (0.0, 0.3, 0.0, 1.2), (0.3, 0.1, 0.3, -0.9), (0.2, 0.2, 0.0, 1.5),
        (0.5, 0.1, 0.2, -1.1), (-0.4, 0.15, 0.1, 0.8), (0.0, 0.1, 0.05, 0.3),
    ]  # fmt: skip
    limits = {"q_min": -3.0, "q_max": 3.0, "v_max": 2.0}
    return ftqp.Robot.from_dh(table, limits=limits, acceleration=5.0, prismatic=(2, 4))


CASES = [
    ("panda", ftqp.Task(), 0.3),
    ("panda", ftqp.Task(priority="position_first"), 0.3),
    ("panda", ftqp.Task(), 2.5),
    ("iiwa14", ftqp.Task(rows="position"), 0.3),
    ("xarm7", ftqp.Task(rows="position_axis"), 0.3),
    ("xarm7", ftqp.Task(rows="position_axis", axis=(1.0, 1.0, 0.0)), 2.0),
    ("puma560", ftqp.Task(rows=("x", "z")), 0.3),
    ("planar6", ftqp.Task(rows=("x", "y", "rz")), 0.5),
    ("slider", ftqp.Task(), 0.4),
]


@pytest.mark.parametrize(("name", "task", "angle"), CASES)
def test_the_curvature_is_the_hessian_of_half_the_squared_error(name, task, angle):
    rng = np.random.default_rng(3)
    robot = sliding_arm() if name == "slider" else ftqp.robots.load(name)
    q = robot.neutral + rng.uniform(-0.4, 0.4, robot.nv)
    away = q + rng.uniform(-0.2, 0.2, robot.nv)
    pose = robot.pose(away)
    axis = rng.normal(size=3) if robot.default_rows != ("x", "y") else np.array([0.0, 0.0, 1.0])
    axis *= angle / np.linalg.norm(axis)
    pose[:3, :3] = rotation(axis) @ robot.pose(q)[:3, :3]
    pose[:3, 3] += rng.uniform(-0.3, 0.3, 3)
    _, K = record_of(robot, level="velocity", task=task)
    K.task.target[:] = ftqp.Target(pose=pose).packed
    expected = hessian(K, q)
    energy(K, q)
    n, m = robot.nv, int(K.task.m)
    s = curvature(K.faults, K.task, K.kinematics, K.chain, K.settling)
    A, e = K.settling.A[:m, :n].copy(), K.settling.e[:m].copy()
    gradient = [(energy(K, q + d) - energy(K, q - d)) / (2.0 * STEP) for d in STEP * np.eye(n)]
    np.testing.assert_allclose(-A.T @ e, gradient, atol=1e-7)
    energy(K, q)
    S = K.settling.S[:n, :n]
    assert s == pytest.approx(np.linalg.norm(S))
    np.testing.assert_allclose(K.settling.A[:m, :n].T @ K.settling.A[:m, :n] + S, expected, atol=2e-7)


def rotation(vector):
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    X = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * X + (1.0 - np.cos(angle)) * X @ X


def test_an_arm_at_rest_keeps_its_metric_and_its_commands_are_those_of_one_that_does_not(level):
    robot = ftqp.robots.load("panda")
    keeps, forgets = (Ticks(robot, 0.002, ftqp.Locked(1), level=level) for _ in range(2))
    pose = robot.pose(robot.neutral)
    pose[:3, 3] += (-0.1, 0.15, 0.0)  # of what joint 2 alone can reach
    target, q, v = ftqp.Target(pose=pose), robot.neutral.copy(), np.zeros(robot.nv)
    for ticks in (keeps, forgets):
        ticks.K.settling.on = 1
        ticks.reset(q)
    same = 0
    for _ in range(3000):
        forgets.K.settling.kept = 0
        before = keeps.K.settling.kept_q.copy()
        assert keeps.tick(q, v, target) == forgets.tick(q, v, target)
        same += keeps.K.settling.kept == 1 and np.array_equal(before, keeps.K.settling.kept_q)
        for signal in ("q_command", "v_command", "a_command"):
            np.testing.assert_array_equal(keeps.K.state[signal], forgets.K.state[signal])
        q, v = keeps.K.state.q_command[: robot.nv].copy(), keeps.K.state.v_command[: robot.nv].copy()
    assert same > 500, "it rests, and the metric is that of the tick before"
