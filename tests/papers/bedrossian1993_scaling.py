"""The manoeuvres of Bedrossian 1993 on the calibrated arm, led by the path's progress."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from tests.going import closed_loop

import ftqp

INCH = 0.0254
Q1 = np.deg2rad([45.0, -60.0, 0.0, -45.0, 0.0, 45.0, 90.0, 45.0, 0.0, 0.0, 0.0])
Q2 = np.deg2rad([0.0, -50.0, 0.0, -30.0, 0.0, 70.0, 0.0, 30.0, 0.0, 0.0, 0.0])
OFFSET = np.deg2rad([0.1, 0.0, 0.1, 0.0, -0.1, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0])
STARTS = {"N": Q2, "R": Q2 + OFFSET}
ROLLS_TOO = (1, 2, 3, 4, 5, 7, 9, 11)
"""E3-blocked: every roll locked as well."""
NO_LIMIT = 1e7
"""An acceleration limit that does not bind [deg/s2]."""
DT = 0.01


def planner(
    limit: float = 50.0,
    rate_change: float = NO_LIMIT,
    mode: str = "scaled",
    level: str = "velocity",
    **settings: Any,
) -> ftqp.Planner:
    """The arm at ``limit`` [deg/s] and ``rate_change`` [deg/s2], gain 2 1/s at the velocity level."""
    robot = ftqp.robots.load("modular11").with_limits(v_max=np.deg2rad(limit), a_max=np.deg2rad(rate_change))
    gain = 2.0 if level == "velocity" else None
    task = ftqp.Task(mode=mode, kp=settings.pop("kp", gain), calm=False, degrade=())  # the paper has neither
    return ftqp.Planner(robot, DT, level=level, task=task, emergency=None, **settings)


def lock(arm: ftqp.Planner, joints: tuple[int, ...]) -> None:
    """Lock joints, numbered from 1 as in the paper, at once."""
    for joint in joints:
        arm.report(ftqp.Locked(joint - 1, mode="instant"))


@dataclass
class Run:
    """How a run went; lengths in inches, angles in degrees."""

    follower: ftqp.PathFollower
    time: float
    progress: float
    off_path: float
    turned: float
    fastest: float
    blocked_at: float | None
    v: Any
    rates: Any
    progresses: Any


def follow(
    q: Any = Q2,
    locks: tuple[int, ...] = (2, 4, 7),
    inches: tuple[float, float, float] = (-100.0, 0.0, 0.0),
    stall: ftqp.StallEscape | None = ftqp.StallEscape(),  # noqa: B008
    longest: float = 60.0,
    until_blocked: bool = False,
    **settings: Any,
) -> Run:
    """Follow a straight line in 20 s of path time, until it is done, blocked, or ``longest`` [s] are over."""
    arm = planner(**settings)
    way = np.array(inches) * INCH
    path = ftqp.paths.Line(arm.robot.pose(q), way, duration=20.0, law="constant")
    follower = ftqp.PathFollower(arm, path, stall=stall)
    lock(arm, locks)
    direction = way / np.linalg.norm(way)
    off, turned, blocked_at = 0.0, 0.0, None
    speeds, rates, progresses = [], [], []
    for k, step in enumerate(closed_loop(follower, None, round(longest / DT), q)):
        tip = follower.target.position - step.task_error[:3] - path.start[:3, 3]
        along = min(max(float(tip @ direction), 0.0), float(np.linalg.norm(way)))
        off = max(off, float(np.linalg.norm(tip - along * direction)))
        turned = max(turned, step.rotation_error)
        speeds.append(np.abs(step.v).max())
        rates.append(follower.rate)
        progresses.append(follower.progress)
        if blocked_at is None and follower.blocked:
            blocked_at = (k + 1) * DT
        if follower.status is ftqp.PathStatus.DONE or (until_blocked and blocked_at):
            break
    return Run(
        follower=follower,
        time=(k + 1) * DT,
        progress=follower.progress / path.duration,
        off_path=off / INCH,
        turned=float(np.rad2deg(turned)),
        fastest=float(np.rad2deg(max(speeds))),
        blocked_at=blocked_at,
        v=step.v.copy(),
        rates=np.array(rates),
        progresses=np.array(progresses),
    )
