"""Zhang et al. 2016: the arm of the example, and what its motions survive."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.papers.zhang2016 import ARM, BEND, Q0, example, forward, plain_continuation

from ftqp.analysis.coverage.continuing import continuation_study, task_session, track
from ftqp.kernel.layout.survival import Survival

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
        k, j = pairs(task, 8)
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
