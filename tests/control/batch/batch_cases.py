"""Targets, starts, faults and the law that the tests of batches share."""

import numpy as np

import ftqp

DT, TICKS, ARMS = 2e-3, 300, 11
STATUSES = list(ftqp.StepStatus)


def circle(robot, radius=0.03):
    path = ftqp.paths.Circle(robot.pose(robot.neutral), radius, duration=3.0)
    samples = path.sample(np.arange(TICKS) * DT)
    return ftqp.Targets(samples.pose, samples.twist, samples.acceleration)


def robot_of(name):
    """An arm of the catalog, or one whose third and fifth joints slide."""
    if name != "sliding":
        return ftqp.robots.load(name)
    table = [
        (0.0, 0.3, 0.0, 1.2), (0.3, 0.1, 0.3, -0.9), (0.2, 0.2, 0.0, 1.5), (0.5, 0.1, 0.2, -1.1),
        (-0.4, 0.15, 0.1, 0.8), (0.3, 0.1, 0.05, 0.3), (0.2, 0.1, 0.1, -1.0),
    ]  # fmt: skip
    limits = {"q_min": -3.0, "q_max": 3.0, "v_max": 2.0}
    return ftqp.Robot.from_dh(table, limits=limits, acceleration=8.0, prismatic=(2, 4))


def starts(robot, spread=1e-3):
    return robot.neutral + spread * np.random.default_rng(5).normal(size=(ARMS, robot.nv))


def faults_of(robot):
    """A fault an arm, of every kind but a free joint: none, late, two, after the end, at once ..."""
    n = robot.nv
    return [
        None,
        ftqp.Locked(0),
        (ftqp.Locked(2 % n, deceleration=1.0), 40),
        [(ftqp.Locked(1), 60), (ftqp.Locked(n - 1), 61)],
        (ftqp.Locked(n - 2, mode="instant"), 100),
        (ftqp.Degraded(1, velocity=0.2), 50),
        (ftqp.Degraded(2 % n, torque=0.6), 50),
        (ftqp.Locked(1), TICKS + 5),
        [(ftqp.Locked(n - 1), 200), (ftqp.Degraded(0, acceleration=0.3), 20)],
        (ftqp.Locked(robot.joints[n - 1], mode="instant"), 0),
        (ftqp.Locked(2 % n), TICKS - 1),
    ]


OFF_Q, OFF_V = 1e-11, 1e-10
"""Rounding, grown over the ticks; a wrong tick shows at 1e-7."""


def alone(planner_of, robot, q, entry, targets):
    """The same arm tick by tick: final q, v, largest errors, ticks per status, the first that was not OK.

    It goes on from the reference, as a batch does: what a failed joint is sent is not where it is believed
    to be.
    """
    planner, v = planner_of(), np.zeros(robot.nv)
    entry = [] if entry is None else entry if isinstance(entry, list) else [entry]
    told = [one if isinstance(one, tuple) else (one, 0) for one in entry]
    planner.reset(q)
    counts, worst, bad = np.zeros(len(STATUSES), dtype=int), np.zeros(2), -1
    for k in range(len(targets)):
        for fault, at in told:
            if at == k:
                planner.report(fault)
        step = planner.step(q, v, targets.at(k))
        q, v, _ = (part.copy() for part in step.reference)
        counts[STATUSES.index(step.status)] += 1
        if bad < 0 and step.status is not ftqp.StepStatus.OK:
            bad = k
        worst = np.maximum(worst, (step.position_error, step.rotation_error))
    return q, v, worst, counts, bad


def assert_same(done, planner_of, robot, q, faults, targets):
    for arm in range(len(q)):
        own = alone(planner_of, robot, q[arm], faults[arm], targets)
        np.testing.assert_allclose(done.q[arm], own[0], rtol=0.0, atol=OFF_Q, err_msg=f"q of arm {arm}")
        np.testing.assert_allclose(done.v[arm], own[1], rtol=0.0, atol=OFF_V, err_msg=f"v of arm {arm}")
        found = done.position_error[arm], done.rotation_error[arm]
        np.testing.assert_allclose(found, own[2], rtol=0.0, atol=1e-10)
        np.testing.assert_array_equal(done.counts[arm], own[3], err_msg=f"statuses of arm {arm}")
        assert done.first_bad[arm] == own[4], f"first bad tick of arm {arm}"
