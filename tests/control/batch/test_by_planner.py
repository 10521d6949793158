"""Arms of a batch beside whose free joint Python decides: they move as a planner moves them, too."""

import logging

import numpy as np
import pytest
from batch_cases import DT, STATUSES, TICKS, assert_same, circle, starts

import ftqp

LEVELS = ["velocity", "acceleration"]
PANDA = ftqp.robots.load("panda")


def free(joint):
    return ftqp.FreeSwinging(joint, damping=1.0)


@pytest.mark.parametrize("level", LEVELS)
def test_rows_are_given_up_beside_a_free_joint_without_gravity(level, caplog):
    """The first joint of a Panda that stands upright, on a circle that six joints cannot follow."""
    q, faults, ticks = starts(PANDA)[:3], [(free(0), 60), None, (free(0), 0)], np.arange(200)
    samples = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.05, duration=1.0).sample(5e-3 * ticks)
    targets = ftqp.Targets(samples.pose, samples.twist, samples.acceleration)

    def planner_of():
        return ftqp.Planner(PANDA, 5e-3, level=level)

    caplog.set_level(logging.WARNING, logger="ftqp")
    done = ftqp.batch.rollout(planner_of(), q, targets=targets, faults=faults)
    assert not caplog.records
    assert_same(done, planner_of, PANDA, q, faults, targets)
    assert "the task stays infeasible: the attitude is given up" in caplog.messages


@pytest.mark.parametrize("level", LEVELS)
def test_fault_told_while_a_joint_swings_has_everything_decided_anew(level):
    q, targets = starts(PANDA)[:5], circle(PANDA, 0.05)
    faults = [
        [(free(2), 50), (ftqp.Degraded(0, velocity=0.5), 80)],
        [(free(5), 50), (ftqp.Locked(1), 120)],
        [(free(3), 50), (free(5), 90)],
        [(free(3), 50), (ftqp.Locked(3), 51)],
        [(ftqp.Locked(1), 50), (free(5), 50)],
    ]

    def planner_of():
        return ftqp.Planner(PANDA, DT, level=level)

    done = ftqp.batch.rollout(planner_of(), q, targets=targets, faults=faults)
    assert_same(done, planner_of, PANDA, q, faults, targets)


def test_arms_of_both_ways_are_one_result(caplog):
    """With a start that is no number, kept positions, progress, and nothing on the logger."""
    q, v, seen = starts(PANDA)[:4], np.zeros((4, 7)), []
    v[2, 1] = np.nan
    faults = [(free(0), 20), None, (free(0), 20), (free(6), 20)]
    done = ftqp.batch.rollout(
        ftqp.Planner(PANDA, DT),
        q,
        v,
        circle(PANDA),
        faults=faults,
        every=TICKS,
        progress=lambda *pair: seen.append(pair),
    )
    assert seen[-1] == (4, 4) and seen == sorted(seen)
    assert (
        np.isnan(done.q[2]).all() and done.counts[2, STATUSES.index(ftqp.StepStatus.INVALID_INPUT)] == TICKS
    )
    np.testing.assert_array_equal(done.trace[[0, 1, 3], 0], done.q[[0, 1, 3]])
    assert (done.counts.sum(axis=1) == TICKS).all() and not caplog.records


def test_arms_that_a_planner_steps_have_its_tasks_and_constraints_too(panda):
    weightless = panda.with_gravity((0.0, 0.0, 0.0)) if hasattr(panda, "with_gravity") else panda
    target = np.tile(weightless.pose(weightless.neutral), (300, 1, 1))
    elbow = ftqp.PositionTask("panda_joint4", target=(0.0, 0.3, 0.6), weight=100.0, name="elbow")
    ends = []
    for tasks in ((), (elbow,)):
        planner = ftqp.Planner(weightless, 2e-3, task=ftqp.Task(rows="position"), tasks=tasks)
        fault = ftqp.FreeSwinging(0, 1.0)
        done = ftqp.batch.rollout(planner, weightless.neutral, targets=ftqp.Targets(target), faults=[fault])
        planner.reset(weightless.neutral)
        planner.report(fault)
        q, v = weightless.neutral.copy(), np.zeros(7)
        for k in range(300):
            step = planner.step(q, v, ftqp.Targets(target).at(k))
            q, v, _ = (part.copy() for part in step.reference)
        np.testing.assert_allclose(done.q[0], q, atol=1e-12)
        ends.append(q)
    assert np.abs(ends[0] - ends[1]).max() > 1e-3
