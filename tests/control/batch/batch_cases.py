"""Targets, starts and faults that the tests of batches share."""

import numpy as np

import ftqp

DT, TICKS, ARMS = 2e-3, 300, 11
STATUSES = list(ftqp.StepStatus)


def circle(robot, radius=0.03):
    path = ftqp.paths.Circle(robot.pose(robot.neutral), radius, duration=3.0)
    samples = path.sample(np.arange(TICKS) * DT)
    return ftqp.Targets(samples.pose, samples.twist, samples.acceleration)


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
