"""Studies of arms that rest, and of other methods that tolerate failures."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from papers.tolerant_methods import EqualityLocks, HaltOptimization, NoiseTolerantNetwork
from tests import scripts

import ftqp

told = partial(scripts.told, "studies/study_calm.py")


def test_arms_rest_with_calm_and_the_report_lists_what_does_not(tmp_path: Path) -> None:
    told("--quick", "--out", str(tmp_path))
    rows = json.loads((tmp_path / "study_calm-quick.json").read_text(encoding="utf-8"))["rows"]
    assert len(rows) == 60 and {row["mode"] for row in rows} == {"slack", "hard", "scaled", "lexicographic"}
    assert sum(bool(row["broken"]) for row in rows) <= 1
    text = (tmp_path / "study_calm-quick.md").read_text(encoding="utf-8")
    assert "exceptions in 60 runs" in text and "## Limitations" in text


ARM = ftqp.robots.load("panda")
Q0 = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
DT = 4e-3


def ended(method, drift: float, *, seconds: float = 2.0, lock: int | None = 2) -> tuple[float, np.ndarray]:
    """How far the tip is from where it began, and where the joints then are."""
    pose, q, v = ARM.pose(Q0), Q0.copy(), np.zeros(7)
    if lock is not None:
        method.lock(lock, q, v)
    for _ in range(round(seconds / DT)):
        v, _ = method.step(q, pose, np.zeros(6))
        q = q + DT * (v + drift)
    return float(np.linalg.norm(ARM.pose(q)[:3, 3] - pose[:3, 3])), q


def test_an_equality_keeps_the_locked_joint_still_and_bounds_keep_the_ranges():
    method = EqualityLocks(ARM, DT)
    method.lock(2, Q0, np.zeros(7))
    v, goes = method.step(Q0, ARM.pose(Q0 + 0.05), np.zeros(6))
    assert v[2] == 0.0 and goes and (np.abs(v) <= ARM.limits.v_max + 1e-6).all()
    near = Q0.copy()
    near[3] = ARM.limits.q_max[3] - 1e-3
    v, _ = EqualityLocks(ARM, DT).step(near, ARM.pose(near) @ np.diag([1.0, 1.0, 1.0, 1.0]), np.full(6, 0.3))
    assert v[3] <= 2.0 * 1e-3 + 1e-6


def test_only_the_network_gets_rid_of_a_constant_drift():
    assert ended(NoiseTolerantNetwork(ARM, DT), 0.01)[0] < 1e-6
    assert 1e-5 < ended(EqualityLocks(ARM, DT), 0.01)[0] < 5e-3


@pytest.mark.parametrize("lock", [0, 2])
def test_a_halt_ends_at_rest_where_the_arm_is_more_able_and_the_tip_then_comes_back(lock):
    method = HaltOptimization(ARM, DT)
    halted, q = ended(method, 0.0, seconds=1.0, lock=lock)

    def able(at):
        J = np.delete(ARM.jacobian(at) * np.array([1, 1, 1, *3 * [ARM.length]])[:, None], lock, axis=1)
        return np.sqrt(np.linalg.det(J @ J.T))

    assert halted > 0.02 and able(q) > 1.1 * able(Q0) and q[lock] == Q0[lock]
    assert (q >= ARM.limits.q_min).all() and (q <= ARM.limits.q_max).all()
