"""Arms that are driven many at once move as a planner moves each."""

import numpy as np
import pytest

import ftqp
from ftqp.control.batch.own_faults import OwnFaults
from ftqp.kernel.entry.rollouts import Batch
from ftqp.kernel.layout.free_memory import free_dtype
from ftqp.kernel.layout.record import record_dtype

DT, TICKS = 0.01, 18
STATUSES = list(ftqp.StepStatus)
FAULTS = [
    None,
    (ftqp.Locked(1), 4),
    [(ftqp.Degraded(0, velocity=0.2), 2), (ftqp.Locked(2, mode="instant"), 9)],
    None,
    (ftqp.FreeSwinging(2, damping=0.5), 5),
    (ftqp.Locked(0, deceleration=2.0), 17),
]
DAMPED = ftqp.Task(rows=("x", "y"), damping=ftqp.DirectionalDamping())
NOWHERE = 3
"""The arm whose start is no number."""


def robot():
    return ftqp.robots.load("planar", count=3)


def planner_of(**settings):
    return ftqp.Planner(robot(), DT, **{"level": "velocity", "task": ftqp.Task(rows=("x", "y"))} | settings)


def starts(spread=0.05):
    q = robot().neutral + spread * np.random.default_rng(5).normal(size=(6, 3))
    q[NOWHERE, 1] = np.nan
    return q


def targets(way=0.1):
    arm = robot()
    path = ftqp.paths.Line(arm.pose(arm.neutral), (-way, 0.5 * way, 0.0), duration=DT * TICKS)
    sample = path.sample(DT * np.arange(TICKS))
    return ftqp.Targets(sample.pose, sample.twist, sample.acceleration)


def alone(planner, q, entry, given):
    """q of every tick, v at the end, largest error and statuses of the same arm tick by tick."""
    entry = [] if entry is None else entry if isinstance(entry, list) else [entry]
    v, way, codes, worst = np.zeros(3), [], [], 0.0
    planner.reset(q)
    for k in range(len(given)):
        for fault, at in entry:
            if at == k:
                planner.report(fault)
        step = planner.step(q, v, given.at(k))
        q, v = step.q.copy(), step.v.copy()
        way.append(q)
        codes.append(step.status)
        worst = max(worst, step.position_error)
    return np.array(way), v, worst, codes


@pytest.mark.parametrize(
    "settings",
    [
        {},
        pytest.param({"level": "acceleration"}, marks=pytest.mark.slow),
        pytest.param({"task": DAMPED}, marks=pytest.mark.slow),
        pytest.param({"scheme": "mvn_manipulability"}, marks=pytest.mark.slow),
    ],
    ids=["velocity", "acceleration", "damped", "with gradients"],
)
@pytest.mark.parametrize("frees", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_every_arm_moves_as_a_planner_moves_it(settings, frees):
    which = [k for k in range(6) if frees or k != 4]
    q, faults, given = starts()[which], [FAULTS[k] for k in which], targets()
    done = ftqp.batch.rollout(planner_of(**settings), q, targets=given, faults=faults, every=4, threads=1)
    assert (done.counts.sum(axis=1) == TICKS).all()
    for arm, k in enumerate(which):
        if k == NOWHERE:
            assert done.share(ftqp.StepStatus.INVALID_INPUT)[arm] == 1.0 and done.first_bad[arm] == 0
            assert np.isnan(done.q[arm]).all() and np.isnan(done.trace[arm][:, 1]).all()
            continue
        way, v, worst, codes = alone(planner_of(**settings), q[arm], faults[arm], given)
        np.testing.assert_allclose(done.trace[arm], way[3::4], rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(done.q[arm], way[-1], rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(done.v[arm], v, rtol=0.0, atol=1e-11)
        assert done.position_error[arm] == pytest.approx(worst, abs=1e-12)
        assert done.counts[arm].tolist() == [codes.count(status) for status in STATUSES]
        bad = [at for at, code in enumerate(codes) if code is not ftqp.StepStatus.OK]
        assert done.first_bad[arm] == (bad[0] if bad else -1)


def test_a_flag_stops_arms_between_two_ticks():
    what_ifs, q, given = planner_of().what_ifs(), starts()[:2], targets()
    own, session = OwnFaults(None, 2, what_ifs.robot, what_ifs), what_ifs.session
    batch = Batch(
        q=q.copy(), v=np.zeros_like(q), targets=given.packed, beliefs=own.beliefs, events=own.events,
        starts=own.starts, skipped=np.array([1, 0]), returns=False, every=0, position_error=np.zeros(2),
        rotation_error=np.zeros(2), counts=np.zeros((2, len(STATUSES)), dtype=np.int64),
        first_bad=np.full(2, -1), trace=np.zeros((2, 0, 3)),
    )  # fmt: skip
    record, own_record = batch.record(), np.zeros(1, record_dtype(session.capacity))
    call = session.bind("rollout", record, own_record, np.zeros(1, free_dtype(session.capacity)), 0, 2)
    record["stop"] = 1
    assert call() == 0 and batch.counts.sum() == 0
    record["stop"] = 0
    assert call() == 1 and batch.counts.sum(axis=1).tolist() == [0, TICKS]
    assert np.array_equal(batch.q[0], q[0]) and not np.array_equal(batch.q[1], q[1])
