"""The approximate pseudoinverse of Holt and Desrochers on the PUMA 560, with the corrected claims."""

import numpy as np
import pytest

import ftqp
from ftqp.control.planner.qp_solver import wrist_height
from ftqp.model.catalog.arms import published

A2, A3, D3, D4 = 0.4318, 0.0203, 0.15005, 0.4318
TABLE = published("puma560")["dh"]
STRETCHED = -90.0 + np.degrees(np.arctan2(A3, D4))
"""theta 3 at which the arm is stretched [deg]."""
EXACT = 1e-7
"""A threshold that keeps every singular value but the vanishing ones."""
rng = np.random.default_rng(0)


def wrist(degrees):
    """The Jacobian at the wrist centre in frame 6 and the wrist centre in the base, from the DH table."""
    T, axes, origins = np.eye(4), [], []
    for (_, d, a, alpha), theta in zip(TABLE, np.deg2rad(degrees), strict=True):
        axes.append(T[:3, 2].copy())
        origins.append(T[:3, 3].copy())
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        T = T @ np.array(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    J = np.array(
        [np.concatenate([np.cross(z, T[:3, 3] - o), z]) for z, o in zip(axes, origins, strict=True)]
    ).T
    return np.vstack([T[:3, :3].T @ J[:3], T[:3, :3].T @ J[3:]]), T[:3, 3]


def postures(count, *, stretched=False, wrist_singular=False):
    """Random postures, regular in what is not asked to be singular: B is too where the arm is stretched."""
    found = []
    while len(found) < count:
        q = rng.uniform(-170.0, 170.0, 6)
        if stretched:
            q[2] = STRETCHED
        if wrist_singular:
            q[4] = 0.0
        J, _ = wrist(q)
        sB, sE = np.linalg.svd(J[:3, :3])[1][2], np.linalg.svd(J[3:, 3:])[1][2]
        if (stretched or sB > 0.03) and (wrist_singular or sE > 0.1):
            found.append(J)
    return found


def norm(M):
    return float(np.linalg.norm(M, 2))


def test_start_pose_has_the_singular_values_of_the_study():
    J, centre = wrist([0, 45, 180, 0, 45, 0])
    assert np.linalg.svd(J[:3, :3])[1] == pytest.approx([0.69023, 0.612505, 0.262984], abs=1e-6)
    assert np.linalg.svd(J[3:, 3:])[1] == pytest.approx([1.306563, 1.0, 0.541196], abs=1e-6)
    assert np.abs(J[:3, 3:]).max() < 1e-15
    pose = ftqp.robots.load("puma560").pose(np.deg2rad([0, 45, -180, 0, 45, 0]))
    assert pose[:3, 3] - centre == pytest.approx(0.1 * pose[:3, 2], abs=1e-12)


def test_determinants_of_the_blocks_are_those_of_the_formulas():
    for _ in range(50):
        q = rng.uniform(-170.0, 170.0, 6)
        J, p = wrist(q)
        rho = np.sqrt(p[0] ** 2 + p[1] ** 2 - D3**2)
        B = A2 * np.hypot(A3, D4) * abs(np.sin(np.deg2rad(q[2] - STRETCHED))) * rho
        assert abs(np.linalg.det(J[:3, :3])) == pytest.approx(B, rel=1e-9)
        assert np.linalg.det(J[3:, 3:]) == pytest.approx(-np.sin(np.deg2rad(q[4])), rel=1e-9)


def test_it_is_the_inverse_at_regular_postures():
    for J in postures(100):
        inverse = np.linalg.inv(J)
        assert np.abs(ftqp.approximate_pinv(J, EXACT) - inverse).max() < 1e-10 * norm(inverse)


def blocks(J, X):
    """J X J - J and the block that the corrected property predicts."""
    B, D, E = J[:3, :3], J[3:, :3], J[3:, 3:]
    Bp, Ep = np.linalg.pinv(B, rcond=1e-9), np.linalg.pinv(E, rcond=1e-9)
    predicted = np.zeros((6, 6))
    predicted[3:, :3] = -(np.eye(3) - E @ Ep) @ D @ (np.eye(3) - Bp @ B)
    return J @ X @ J - J, predicted


@pytest.mark.parametrize("stretched", [False, True])
@pytest.mark.parametrize("wrist_singular", [False, True])
def test_moore_penrose_table(stretched, wrist_singular):
    for J in postures(75, stretched=stretched, wrist_singular=wrist_singular):
        X = ftqp.approximate_pinv(J, EXACT)
        size = norm(X)
        rest, predicted = blocks(J, X)
        assert np.abs(rest - predicted).max() < 1e-9 * max(1.0, size)
        assert np.abs(X @ J @ X - X).max() < 1e-9 * size * max(1.0, size)
        left, right = J @ X, X @ J
        if not (stretched and wrist_singular):
            assert np.abs(rest).max() < 1e-9 * max(1.0, size)
        else:
            assert norm(rest) <= norm(J[3:, :3]) + 1e-9
        if not stretched:
            assert np.abs(right - right.T).max() < 1e-8 * size
        if not wrist_singular:
            assert np.abs(left - left.T).max() < 1e-8 * size


def test_the_pseudoinverse_law_fails_where_both_blocks_are_singular():
    J, _ = wrist([10.0, 36.30284, 20.0, 15.0, 0.0, 5.0])
    X = ftqp.approximate_pinv(J, EXACT)
    assert norm(J @ X @ J - J) == pytest.approx(0.698432, abs=1e-6)
    assert norm(J) == pytest.approx(1.790095, abs=1e-6)


def test_position_comes_first_and_orientation_gets_what_is_left():
    for J in postures(20, wrist_singular=True):
        twist = rng.normal(size=6)
        dq = ftqp.approximate_pinv(J, EXACT) @ twist
        assert J[:3] @ dq == pytest.approx(twist[:3], abs=1e-9)
        assert dq[3:] == pytest.approx(
            np.linalg.pinv(J[3:, 3:], rcond=1e-9) @ (twist[3:] - J[3:, :3] @ dq[:3]), abs=1e-7
        )


def test_elbow_reaches_the_threshold_thirty_degrees_from_stretched():
    def least(offset):
        return np.linalg.svd(wrist([0.0, 20.0, STRETCHED + offset, 0.0, 60.0, 0.0])[0][:3, :3])[1][2]

    for sign in (-1.0, 1.0):
        edge = next(x for x in np.arange(0.0, 60.0, 0.01) if least(sign * x) > 0.1)
        assert edge == pytest.approx(30.5, abs=0.1)
    values = [least(x) for x in (5.0, 10.0, 20.0, 30.0, 40.0)]
    assert values == pytest.approx([0.0166, 0.0332, 0.0661, 0.0984, 0.1299], abs=2e-4)


def test_well_around_hand_over_head_is_narrower_and_its_walls_higher():
    """Figure 1: the norms of the truncated inverses while joint 2 sweeps through the singularity."""
    sweep = np.arange(-40.0, 40.0, 0.05)
    full, block, cut_full, cut_block = [], [], [], []
    for x in sweep:
        J, _ = wrist([0.0, 36.3028 + x, 20.0, 17.19, 40.11, 0.0])
        s = np.linalg.svd(J)[1]
        full.append(1.0 / s[s > 0.1].min())
        cut_full.append(s[-1] <= 0.1)
        block.append(norm(ftqp.approximate_pinv(J, 0.1)))
        cut_block.append(min(np.linalg.svd(J[:3, :3])[1][2], np.linalg.svd(J[3:, 3:])[1][2]) <= 0.1)
    for cut, edges in ((cut_full, (-21.9, 25.7)), (cut_block, (-11.6, 11.9))):
        assert (sweep[cut].min(), sweep[cut].max()) == pytest.approx(edges, abs=0.2)
    assert max(full) == pytest.approx(9.98, abs=0.01) and max(block) == pytest.approx(20.6, abs=0.1)
    assert max(full) <= 10.0 < max(block)


def test_planner_follows_the_very_inverse():
    """The planner's form along W, with the twist moved to the wrist centre, is J-dagger in frame 6."""
    robot = ftqp.robots.load("puma560")
    assert wrist_height(robot) == pytest.approx(0.0, abs=1e-12)
    for q in ([0, 45, -180, 0, 45, 0], [10, 20, -100, 30, 0.5, 40], [10, 36.30284, 20, 15, 0, 5]):
        q = np.deg2rad(np.array(q, dtype=float))
        planner = ftqp.Planner(
            robot.with_limits(a_max=1e9, v_max=1e6), 0.01, level="velocity",
            scheme="approximate_pseudoinverse", task=ftqp.Task(rows="pose", kp=0.0), emergency=None,
        )  # fmt: skip
        planner.reset(q)
        twist = np.array([0.02, -0.03, 0.01, 0.1, -0.2, 0.05])
        step = planner.step(q, np.zeros(6), ftqp.Target(pose=robot.pose(q), twist=twist))
        J, centre = wrist(np.degrees(q))
        pose = robot.pose(q)
        moved = twist.copy()
        moved[:3] -= np.cross(twist[3:], pose[:3, 3] - centre)
        R = pose[:3, :3].T
        expected = ftqp.approximate_pinv(J, 0.1) @ np.concatenate([R @ moved[:3], R @ moved[3:]])
        assert step.v == pytest.approx(expected, abs=1e-11)
