"""Zhang et al. 2016: the arm of the example, and what its motions survive."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.papers.zhang2016 import ARM, BEND, Q0, end_pose, error, example, forward, plain_continuation

from ftqp.analysis import coverage, null_vector, task_path
from ftqp.analysis.survival.continuing import continuation_study, task_session, track
from ftqp.analysis.survival.way_round import bound_of
from ftqp.control.paths import Line, PointToPoint
from ftqp.kernel.layout.enums import Survival
from ftqp.model import catalog

STANDING = np.deg2rad([18.7, -60.7, -2.0, -77.0, 84.9, 54.7, -55.0])
"""The start that survives everything on 40 % of the path."""


def pairs(task, stride):
    return tuple(a.ravel() for a in np.meshgrid(np.arange(0, task.N, stride), np.arange(7), indexing="ij"))


def share_survived(task, q, stride):
    k, j = pairs(task, stride)
    found = continuation_study(task).runs(q[k], k, j)
    return ((found.status == Survival.SURVIVED) & (np.abs(q[k]).max(axis=1) <= BEND)).mean()


def test_start_pose_and_its_measures_are_those_of_the_example() -> None:
    T, J = forward(Q0)
    assert np.allclose(T, ARM.pose(Q0), atol=1e-12) and np.allclose(J, ARM.jacobian(Q0), atol=1e-12)
    assert np.allclose(T[:3, 3], (6.261403, -4.253646, 5.447147), atol=1e-5)
    rpy = Rotation.from_matrix(T[:3, :3]).as_euler("xyz")
    assert np.allclose(rpy, (-0.117268, 0.019384, -0.545400), atol=1e-5)
    Z = [(-1) ** i * np.linalg.det(np.delete(J, i, axis=1)) for i in range(7)]
    wanted = (-61.52766, 5.045367, 42.348167, 21.20657, -64.809035, 2.456275, 62.862455)
    assert np.allclose(Z, wanted, atol=1e-5)
    assert np.isclose(np.linalg.norm(Z), 119.2146, atol=1e-4)
    assert np.isclose(np.linalg.svd(J, compute_uv=False)[-1], 0.346779, atol=1e-5)


def test_start_on_its_self_motion_makes_every_failure_of_the_short_path_survivable() -> None:
    task = example(0.05, share=0.4)
    q, left, _ = task_session(task).solutions(STANDING[None])
    assert left[0] < 1e-10
    motion = track(task, q[0])
    k, j = pairs(task, 1)
    found = continuation_study(task).runs(motion[k], k, j)
    assert len(found.status) == 2800 and (found.status == Survival.SURVIVED).all()
    assert found.margin.min() >= np.deg2rad(35.0)
    assert share_survived(task, track(task, Q0), 4) == pytest.approx(0.883, abs=0.01)


def test_coarse_steps_do_not_jump_over_a_singularity_unnoticed() -> None:
    task = example(1.0)
    q = track(task, Q0, 0.10)
    k, j = pairs(task, 1)
    mine = continuation_study(task).runs(q[k], k, j).status == Survival.SURVIVED
    guarded, unguarded = (
        np.array([plain_continuation(task.goals, q[a], a, b, guard) for a, b in zip(k, j, strict=True)])
        == Survival.SURVIVED
        for guard in (True, False)
    )
    assert mine.mean() == pytest.approx(0.786, abs=0.002) and (mine == guarded).all()
    assert unguarded.mean() == pytest.approx(0.807, abs=0.01) and unguarded.mean() > guarded.mean()
    fine = example(0.05)
    assert share_survived(fine, track(fine, Q0, 0.10), 4) == pytest.approx(0.831, abs=0.01)


def test_statuses_are_those_of_plain_numpy() -> None:
    task = example(0.25)
    for theta in (0.0, 0.10):
        q = track(task, Q0, theta)
        k, j = pairs(task, 24)
        mine = continuation_study(task).runs(q[k], k, j).status
        plain = [plain_continuation(task.goals, q[a], a, b) for a, b in zip(k, j, strict=True)]
        assert (mine == np.array(plain)).all()


def test_label_of_a_configuration_does_not_depend_on_how_it_was_reached() -> None:
    task = example(0.25)
    one = track(task, Q0, 0.1)
    other = track(task, Q0, np.where(np.arange(task.N) < 40, 0.1, -0.3))
    assert np.allclose(one[40], other[40]) and not np.allclose(one[60], other[60])
    study, joints, at = continuation_study(task), np.arange(7), np.full(7, 40)
    labels = [study.runs(q[at], at, joints).status for q in (one, other)]
    assert (labels[0] == labels[1]).all()


def planar_oracle(task, q):
    """Which locks of a planar arm of three unit links are survived, in closed form, (3, N)."""
    p = task.goals[:, :2, 3]
    distance = np.linalg.norm(p, axis=1)
    survived = np.zeros((3, task.N), dtype=bool)
    for k in range(task.N):
        later, (q1, q2, q3) = p[k:], q[k]
        rest = np.linalg.norm(later - [np.cos(q1), np.sin(q1)], axis=1)
        A, B = 2.0 * abs(np.cos(q2 / 2.0)), 2.0 * abs(np.cos(q3 / 2.0))
        survived[0, k] = (rest > 0.0).all() and (rest < 2.0).all()
        survived[1, k] = (np.abs(A - 1.0) < distance[k:]).all() and (distance[k:] < A + 1.0).all()
        survived[2, k] = (np.abs(1.0 - B) < distance[k:]).all() and (distance[k:] < 1.0 + B).all()
    return survived


@pytest.mark.parametrize(("theta", "share"), [(0.0, 0.7467), (0.2, 0.8233), (0.4, 0.8700), (1.0, 0.8367)])
def test_locks_of_a_planar_arm_are_survived_where_the_closed_form_says_so(theta: float, share: float) -> None:
    arm = catalog.load("planar", lengths=(1.0, 1.0, 1.0), continuous=True).with_limits(v_max=np.inf)
    start = np.eye(4)
    start[:2, 3] = 1.9, -0.8
    task = task_path(arm, Line(start, (-1.4, 2.0, 0.0), duration=10.0), rows="position", dt=0.1)
    q = track(task, (-1.524418, 1.260809, 0.741032), theta)
    found = coverage(arm, task, q, stride=1)
    assert (found.survived == planar_oracle(task, q)).all()
    assert found.coverage == pytest.approx(share, abs=2e-4)
    assert max(found.worst_error) < 1e-8


@pytest.mark.slow
def test_entries_that_keep_their_sign_do_not_prove_tolerance() -> None:
    arm = catalog.load("planar", lengths=(1.0, 1.0, 1.0), continuous=True).with_limits(v_max=np.inf)
    start = np.eye(4)
    start[:2, 3] = 1.9, -0.8
    task = task_path(arm, Line(start, (-1.4, 2.0, 0.0), duration=10.0), rows="position", dt=0.1)
    for theta in (-0.1, 0.1, 0.4):
        found = coverage(arm, task, track(task, (-1.524418, 1.260809, 0.741032), theta), stride=1)
        assert (found.sign_changes == 0).all() and 0.67 < found.coverage < 0.88


@pytest.mark.parametrize(
    ("gain", "position", "rotation"),
    [(0.0, 3.5e-2, 2.8e-3), (1.0, 3.0e-3, 2.9e-4), (10.0, 3.1e-4, 3.0e-5), (20.0, 1.5e-4, 1.5e-5)],
)
def test_published_errors_are_those_of_euler_steps_with_feedback(
    gain: float, position: float, rotation: float
) -> None:
    path = PointToPoint(ARM.pose(Q0), end_pose(), duration=20.0, law="constant")
    task = task_path(ARM, path, dt=0.05)
    q, worst = Q0.copy(), np.zeros(2)
    twist = path.sample(task.t).twist
    for k in range(task.N):
        T, J = forward(q)
        e = error(task.goals[k], T)
        q = q + task.dt * (np.linalg.pinv(J) @ (twist[k] + gain * e) + 0.1 * null_vector(J))
        off = error(task.goals[k + 1], forward(q)[0])
        worst = np.maximum(worst, (np.linalg.norm(off[:3]), np.linalg.norm(off[3:])))
    assert 1.0 / 1.5 < worst[0] / position < 1.5 and 1.0 / 1.5 < worst[1] / rotation < 1.5


@pytest.mark.slow
def test_no_posture_found_survives_everything_before_most_of_the_path_is_done() -> None:
    bound = bound_of(example(0.05), 20)
    samples, joints = bound.samples * bound.stride, bound.counts(range(len(bound.samples)))
    assert (joints[samples < 0.65 * 400] <= 6).all() and (joints[samples > 0.75 * 400] == 7).all()


@pytest.mark.parametrize(
    ("theta", "survived", "farthest"),
    [(0.0, False, 100), (0.1, True, 107), (0.16, True, 135), (0.25, True, 197)],
)
def test_two_published_failures_are_survived_by_motions_that_survive_little(
    theta: float, survived: bool, farthest: int
) -> None:
    task = example(0.05)
    q = track(task, Q0, theta)
    found = coverage(ARM, task, q)
    assert found.survives(3, 5.0) == survived and found.survives(1, 10.0)
    assert round(np.rad2deg(np.abs(q)).max()) == farthest and found.coverage < 0.84


def test_zero_of_an_entry_is_seen_by_its_sign_and_not_by_its_size() -> None:
    task = example(0.05)
    found = coverage(ARM, task, track(task, Q0))
    assert found.sign_changes.tolist() == [0, 0, 0, 0, 0, 1, 0]
    assert found.least_manipulability[5] > 5e-4
