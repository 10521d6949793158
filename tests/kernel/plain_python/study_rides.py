"""Short studies of small arms: many at once, what a failure leaves, and QPs without a robot."""

from typing import Any

import numpy as np
from riding import DT, arm, ride, spatial

import ftqp


@ride
def many_arms_and_blocks() -> Any:
    said = []
    for level in ("acceleration", "velocity"):
        robot = arm(3)
        planner = ftqp.Planner(robot, DT, level=level, emergency=None)
        path = ftqp.paths.Line(robot.pose(robot.neutral), (0.0, 0.1, 0.0), duration=0.12)
        sample = path.sample(np.arange(0.0, 0.12, DT))
        targets = ftqp.Targets(sample.pose, sample.twist, sample.acceleration)
        faults = [None, (ftqp.Locked(1), 3), ftqp.Degraded(0, velocity=0.1)]
        result = ftqp.batch.rollout(
            planner, robot.neutral, targets=targets, faults=faults, every=4, threads=1
        )
        said.append([result.q.tolist(), result.v.tolist(), result.trace.tolist()])
    return said


@ride
def failures_that_a_motion_survives() -> Any:
    robot = arm(3)
    path = ftqp.paths.Line(robot.pose(robot.neutral), (0.0, 0.1, 0.0), duration=1.0)
    q = [robot.neutral.copy()]
    for pose in path.sample(np.linspace(0.0, 1.0, 13)[1:]).pose:
        now, J = robot.pose(q[-1]), robot.jacobian(q[-1])
        q.append(q[-1] + np.linalg.pinv(J[:2]) @ (pose[:2, 3] - now[:2, 3]))
    report = ftqp.analysis.coverage(robot, path, np.array(q), stride=6)
    return [report.coverage, np.asarray(report.status).tolist()]


@ride
def simulation_in_blocks() -> Any:
    robot = arm(3)
    planner = ftqp.Planner(robot, DT)
    path = ftqp.paths.Line(robot.pose(robot.neutral), (0.0, 0.05, 0.0), duration=0.2)
    result = ftqp.Simulation(planner, path, q=robot.neutral).run()
    return [result.steps, float(result.completed), result.q.tolist()]


@ride
def ends_of_motions_after_a_failure_that_nobody_noticed() -> Any:
    said = []
    robot = ftqp.robots.load("planar", lengths=(1.0, 1.0, 0.5), continuous=True)
    start = np.array([0.3, 0.8, 0.5])
    for weights in (None, np.diag([1.0, 2.0, 3.0])):
        out = ftqp.analysis.outcome(robot, [1.2, 0.9], start, locked=["j2"], W=weights)
        said.append([*out.q, out.error])
    other = spatial()
    goal = other.pose(other.neutral)[:3, 3] + np.array([0.0, 0.05, 0.02])
    out = ftqp.analysis.outcome(other, goal, other.neutral, locked=[3], horizon=2.0)
    return [*said, [*out.q, out.error]]


@ride
def a_qp_without_a_robot() -> Any:
    rng = np.random.default_rng(4)
    said = []
    for backend in ("active_set", "dtrnn"):
        for rows in (0, 2):
            M = rng.normal(size=(5, 5))
            problem = ftqp.QP(
                M @ M.T + np.eye(5), rng.normal(size=5),
                A=rng.normal(size=(2, 5)), b=0.1 * rng.normal(size=2),
                C=rng.normal(size=(rows, 5)) if rows else None, l=-np.ones(rows) if rows else None,
                u=np.ones(rows) if rows else None, lb=-np.ones(5), ub=np.ones(5),
            )  # fmt: skip
            solution = ftqp.qp.solve(problem, backend=backend)
            said.append([*solution.x, float(solution.status.name == "SOLVED")])
    return said


@ride
def failures_survived_with_brakes_and_with_half_the_speed() -> Any:
    robot, q = arm(3), [arm(3).neutral.copy()]
    path = ftqp.paths.Line(robot.pose(robot.neutral), (0.0, 0.1, 0.0), duration=1.0)
    for pose in path.sample(np.linspace(0.0, 1.0, 9)[1:]).pose:
        now, J = robot.pose(q[-1]), robot.jacobian(q[-1])
        q.append(q[-1] + np.linalg.pinv(J[:2]) @ (pose[:2, 3] - now[:2, 3]))
    said = []
    for options in ({"lock": "ramp"}, {"post": "qp"}, {"fault": "degraded"}):
        report = ftqp.analysis.coverage(robot, path, np.array(q), stride=8, **options)
        said.append([report.coverage, np.asarray(report.status).tolist()])
    return said
