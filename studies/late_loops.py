"""Loops that are late: whether a command keeps every limit over a gap of 2 to 5 ticks.

Random arms on random ways lose joints and miss ticks; the arm holds its last command, or goes on, meanwhile.
The referee looks at the reference alone: its range, and how far it is from what it was k ticks ago.

Run it: python studies/late_loops.py --episodes 10000 (some minutes)
"""

import argparse
from dataclasses import dataclass, field

import numpy as np

import ftqp

ROBOTS = ("panda", "iiwa14", "planar6", "planar(3)", "xarm7", "modular11")
DT = 1e-3
TICKS = 150
"""Ticks of an episode."""
LATE = 0.3
"""Share of the steps that are late."""
ROUNDING = 1e-9


@dataclass
class Count:
    """What the referee has found.

    Attributes:
        episodes: How many were run.
        steps: How many late steps there were in them.
        broken: A sentence for each command that broke a limit.
        refused: Samples after a gap that were refused.
    """

    episodes: int = 0
    steps: int = 0
    broken: list[str] = field(default_factory=list)
    refused: int = 0


def targets(robot, q, rng):
    """Targets on a way that begins at q."""
    path = ftqp.paths.Circle(
        robot.pose(q), radius=float(rng.uniform(0.01, 0.15)), duration=float(rng.uniform(0.3, 3.0))
    )
    motion = path.sample(np.arange(TICKS) * DT)
    return ftqp.Targets(motion.pose, motion.twist, motion.acceleration)


def fault(robot, rng):
    """A fault of a joint."""
    joint = int(rng.integers(robot.nv))
    kind = int(rng.integers(3))
    if kind == 0:
        return ftqp.Locked(joint)
    if kind == 1:
        return ftqp.Locked(joint, mode="instant")
    return ftqp.Degraded(joint, velocity=float(rng.uniform(0.3, 1.0)), torque=float(rng.uniform(0.7, 1.0)))


def episode(seed, count, robots=ROBOTS):
    """One episode; the count is told what was found."""
    rng = np.random.default_rng(seed)
    robot = ftqp.robots.load(robots[int(rng.integers(len(robots)))])
    level = ("acceleration", "velocity")[int(rng.integers(2))]
    planner = ftqp.Planner(robot, DT, level=level)
    limits = robot.limits
    q = np.clip(robot.neutral + rng.uniform(-0.2, 0.2, robot.nv), limits.q_min, limits.q_max)
    planner.reset(q)
    way, breaks, holds = targets(robot, q, rng), int(rng.integers(TICKS)), bool(rng.integers(2))
    sent, last_q, last_v, k, failed = q.copy(), q.copy(), np.zeros(robot.nv), 0, None
    count.episodes += 1
    while k < TICKS:
        gap = int(rng.integers(2, 6)) if rng.random() < LATE else 1
        k += gap
        if k >= TICKS:
            return
        if failed is None and k >= breaks:
            failed = fault(robot, rng)
            planner.report(failed)
        # the arm holds what it was sent, or its own controller goes on at that speed
        measured = sent if holds else sent + (gap - 1) * DT * last_v
        step = planner.step(measured, None, way.at(k), ticks=gap)
        count.steps += gap > 1
        count.refused += step.status is ftqp.StepStatus.INVALID_INPUT
        q, v = step.reference.q.copy(), step.reference.v.copy()
        healthy = np.ones(robot.nv, dtype=bool)
        if failed is not None:
            healthy[robot.joint(failed.joint)] = False
        room, rate = ROUNDING + gap * DT * limits.v_max, ROUNDING + gap * DT * limits.a_max
        found = {
            "range": (q < limits.q_min - ROUNDING) | (q > limits.q_max + ROUNDING),
            "speed": np.abs(v) > limits.v_max + ROUNDING,
            "way over the gap": np.abs(q - last_q) > room,
            "acceleration over the gap": (np.abs(v - last_v) > rate) & healthy,
        }
        for what, where in found.items():
            if (where & healthy).any():
                count.broken.append(f"seed {seed}: {robot.name}, tick {k}, gap {gap}: {what}")
        sent, last_q, last_v = step.q.copy(), q, v


def main(arguments=None):
    """Run the episodes and say what was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
    count = Count()
    for k in range(given.episodes):
        episode(given.seed + k, count)
    text = (
        f"{count.episodes} episodes with {count.steps} late steps: {len(count.broken)} limits broken, "
        f"{count.refused} steps INVALID_INPUT"
    )
    print("\n".join([text, *count.broken[:20]]))
    return 1 if count.broken else 0


if __name__ == "__main__":
    raise SystemExit(main())
