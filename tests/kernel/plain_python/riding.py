"""What rides of small arms are made of: arms, a target that moves, and physics."""

from collections.abc import Callable
from typing import Any

import numpy as np

import ftqp

DT = 0.01
RIDES: dict[str, Callable[[], Any]] = {}


def ride(function: Callable[[], Any]) -> Callable[[], Any]:
    """One of the rides, by its name."""
    RIDES[function.__name__] = function
    return function


def arm(count: int = 4) -> ftqp.Robot:
    """A planar arm."""
    return ftqp.robots.load("planar", count=count)


def spatial() -> ftqp.Robot:
    """An arm of seven joints."""
    return ftqp.robots.load("iiwa14")


def told(step: ftqp.Step) -> list[float]:
    """What one step commands and says."""
    return [*step.q, *step.v, *step.a, float(step.code), step.scale]


def led(
    planner: ftqp.Planner,
    ticks: int,
    *,
    speed: float = 0.3,
    moves: Callable[[int, Any, Any, ftqp.Step], tuple[Any, Any]] | None = None,
    events: dict[int, Callable[[], Any]] | None = None,
    sample: Callable[[int, Any], Any] = lambda k, q: q,
    measures_v: bool = True,
) -> list[list[float]]:
    """A target that moves, an arm that ``moves`` as it likes, and what is commanded."""
    robot = planner.robot
    q, v, said = robot.neutral.copy(), np.zeros(robot.nv), []
    planner.reset(q)
    target = ftqp.Target(pose=robot.pose(q), twist=[0.0, speed, 0.0, 0.0, 0.0, 0.0])
    for k in range(ticks):
        if events and k in events:
            events[k]()
        target.position[1] += DT * speed
        step = planner.step(sample(k, q), v if measures_v else None, target)
        said.append(told(step))
        q, v = (step.q.copy(), step.v.copy()) if moves is None else moves(k, q, v, step)
    return said


def torque_arm(robot: ftqp.Robot, stuck: int | None = None, friction: float = 0.0) -> Any:
    """Rigid-body physics under ``step.tau``; a joint may be stuck from the tenth tick on."""

    def moves(k: int, q: Any, v: Any, step: ftqp.Step) -> tuple[Any, Any]:
        tau = step.tau - friction * np.sign(v) - robot.bias(q, v)
        a = np.linalg.solve(robot.mass_matrix(q), tau)
        v = v + DT * a
        if stuck is not None and k >= 10:
            v[stuck] = 0.0
        return q + DT * v, v

    return moves
