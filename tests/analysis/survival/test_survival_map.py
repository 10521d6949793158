"""At which places an arm can do without each joint."""

import numpy as np
import pytest

from ftqp.analysis.survival.coverage_report import mission_survival
from ftqp.analysis.survival.survival_map import STEPS, survival_map
from ftqp.model import catalog

PANDA = catalog.load("panda")
POSE, POSITION = (survival_map(PANDA, rows, places=40) for rows in ("pose", "position"))


def test_fewer_rows_survive_more_and_the_last_joint_never_matters_to_a_position() -> None:
    assert POSITION.per_joint["panda_joint7"] == 1.0
    assert all(POSITION.per_joint[joint] >= POSE.per_joint[joint] for joint in PANDA.joints)
    for found in (POSE, POSITION):
        assert found.any_joint <= min(found.per_joint.values())
        assert (found.survived <= found.lines[:, None]).all() and found.lines.max() <= 6


def test_structural_joint_is_survived_nowhere() -> None:
    arm = catalog.load("iiwa14")
    assert survival_map(arm, places=30).per_joint[arm.joints[3]] == 0.0


def test_planar_places_are_survived_where_the_closed_form_says_so() -> None:
    arm = catalog.load("planar", lengths=(1.0, 1.0, 1.0), continuous=True).with_limits(v_max=np.inf)
    found = survival_map(arm, places=60, way=0.3)
    same = []
    for place in range(60):
        q1, q2, q3 = found.q[place]
        p = found.places[place, :2]
        ends = p + 0.3 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
        lines = p + np.linspace(0.0, 1.0, STEPS + 1)[:, None, None] * (ends - p)
        far = np.linalg.norm(lines, axis=2)
        possible = (far < 3.0).all(axis=0)
        A, B = 2.0 * abs(np.cos(q2 / 2.0)), 2.0 * abs(np.cos(q3 / 2.0))
        rest = np.linalg.norm(lines - [np.cos(q1), np.sin(q1)], axis=2)
        kept = np.array(
            [
                ((rest > 0.0) & (rest < 2.0)).all(axis=0),
                ((np.abs(A - 1.0) < far) & (far < A + 1.0)).all(axis=0),
                ((np.abs(1.0 - B) < far) & (far < 1.0 + B)).all(axis=0),
            ]
        )
        if found.lines[place] == possible.sum():
            same.append(found.survived[place] == (kept & possible).sum(axis=1))
    assert len(same) > 30 and np.mean(same) > 0.97


ARM = catalog.load("planar", lengths=(1.0, 1.0, 1.0))
T = np.arange(100) * 36.0
END = 3600.0


def test_nothing_survived_leaves_the_chance_of_no_failure() -> None:
    found = mission_survival(ARM, np.zeros((3, 100), dtype=bool), T, END, {"j1": 10.0, 1: 20.0})
    assert np.isclose(found.without, np.exp(-1.0 / 10.0 - 1.0 / 20.0))
    assert found.low == found.likely == found.high == found.without and found.coverage == 0.0


def test_everything_survived_fails_by_a_second_failure_only() -> None:
    hours = {0: 5.0, 1: 10.0, 2: 20.0}
    found = mission_survival(ARM, np.ones((3, 100), dtype=bool), T, END, hours)
    assert np.isclose(found.high, 1.0 - 0.0, atol=1e-2) and found.high <= 1.0 + 1e-12
    none, rates = [np.exp(-1.0 / h) for h in hours.values()], [1.0 / h for h in hours.values()]
    exactly_one = sum((1 - none[j]) * np.prod(none) / none[j] for j in range(3))
    assert np.isclose(found.low, np.prod(none) + exactly_one, rtol=1e-9)
    assert found.low < found.likely < found.high and found.coverage == pytest.approx(1.0)
    assert sum(rates) > 0.0


def test_interval_holds_what_random_failures_show() -> None:
    survived = np.zeros((3, 100), dtype=bool)
    survived[0, 50:], survived[1] = True, True
    hours = np.array([1.0, 2.0, 3.0])
    found = mission_survival(ARM, survived, T, END, dict(enumerate(hours)))
    at = np.random.default_rng(0).exponential(hours * 3600.0, size=(200_000, 3))
    first = at.argmin(axis=1)
    when = at.min(axis=1)
    kept = survived[first, np.minimum(when // 36.0, 99).astype(int)]
    second = (at < END).sum(axis=1) > 1
    alone, any_number = (when >= END) | (kept & ~second), (when >= END) | kept
    assert found.low <= alone.mean() + 0.005 and found.high >= any_number.mean() - 0.005
    assert found.high - found.low < 0.35 and found.low <= found.likely <= found.high
    assert found.coverage == pytest.approx((0.5 * 1.0 + 1.0 / 2.0) / (1.0 + 1.0 / 2.0 + 1.0 / 3.0), abs=0.01)
