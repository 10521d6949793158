"""How fast joints get beside a kind of rows that caps their speed, by planner, as JSON."""

import json
from typing import Any

import numpy as np

import ftqp

DT, TICKS = 0.01, 12
ROBOT = ftqp.robots.load("planar6")
SAMPLE = ftqp.paths.Line(
    ROBOT.pose(ROBOT.neutral), (0.1, 0.1, 0.0), duration=0.2
).sample(DT * np.arange(TICKS))  # fmt: skip
TARGETS = ftqp.Targets(SAMPLE.pose, SAMPLE.twist, SAMPLE.acceleration)
LAST = ROBOT.joints[-1]


def fastest(**settings: Any) -> float:
    """The largest speed of a joint [rad/s]."""
    planner = ftqp.Planner(ROBOT, DT, emergency=None, **settings)
    planner.reset(ROBOT.neutral)
    q, v, found = ROBOT.neutral, np.zeros(ROBOT.nv), 0.0
    for k in range(TICKS):
        step = planner.step(q, v, TARGETS.at(k))
        q, v = step.q.copy(), step.v.copy()
        found = max(found, float(np.abs(v).max()))
    return found


BATCH = ftqp.batch.rollout(
    ftqp.Planner(ROBOT, DT, emergency=None), np.tile(ROBOT.neutral, (9, 1)), targets=TARGETS
)
print(
    json.dumps(
        {
            "acceleration": fastest(level="acceleration"),
            "velocity": fastest(level="velocity"),
            "no torque limits": fastest(torque_limits=False),
            "kept point": fastest(
                constraints=[ftqp.Keep(LAST, above=(-9.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0))]
            ),
            "daqp": fastest(backend="daqp"),
            "batch": float(np.abs(BATCH.v).max()),
        }
    )
)
