"""How far apart step, batch and backend are for a coefficient that a copy of the source has more, as JSON."""

import json
from typing import Any

import numpy as np

import ftqp

DT, TICKS, ARMS = 0.01, 40, 9
ROBOT = ftqp.robots.load("planar6")
SAMPLE = ftqp.paths.Line(
    ROBOT.pose(ROBOT.neutral), (0.03, 0.02, 0.0), duration=DT * TICKS
).sample(DT * np.arange(TICKS))  # fmt: skip
TARGETS = ftqp.Targets(SAMPLE.pose, SAMPLE.twist, SAMPLE.acceleration)
STARTS = ROBOT.neutral + 1e-3 * np.random.default_rng(2).normal(size=(ARMS, ROBOT.nv))


def planner(ballast: float, **settings: Any) -> ftqp.Planner:
    criterion = ftqp.Criterion(norm=1.0, norm_v=4.0, ballast=ballast)  # type: ignore[call-arg]
    scheme = ftqp.Scheme(name="ballast", acceleration=criterion, velocity=criterion)
    return ftqp.Planner(ROBOT, DT, scheme=scheme, **settings)


def stepped(**settings: Any) -> np.ndarray:
    """Where each arm ends, (ARMS, nv)."""
    ends = []
    for q in STARTS:
        v, one = np.zeros(ROBOT.nv), planner(**settings)
        one.reset(q)
        for k in range(TICKS):
            step = one.step(q, v, TARGETS.at(k))
            q, v = step.q.copy(), step.v.copy()
        ends.append(q)
    return np.array(ends)


WANTED = stepped(ballast=0.2)
print(
    json.dumps(
        {
            "effect": float(np.abs(WANTED - stepped(ballast=0.0)).max()),
            "rollout": float(
                np.abs(ftqp.batch.rollout(planner(0.2), STARTS, targets=TARGETS).q - WANTED).max()
            ),
            "backend": float(np.abs(stepped(ballast=0.2, backend="osqp") - WANTED).max()),
        }
    )
)
