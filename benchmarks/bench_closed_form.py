"""Measures closed forms beside the QP: the user step of a Panda at the velocity level, ratios in one run.

    python benchmarks/bench_closed_form.py [--quick]

Every scheme gets the same state and the same target again and again, a chunk at a time in turn: once a twist
within every limit, once one so fast that the damping rule and the limits of the QP act. After a few steps the
planner is put back to the state, untimed: a planner whose arm does not move waits for it. No figure is a pass
or a fail.
"""

import argparse
import json
import sys
import time
from typing import Any

import numpy as np

import ftqp

RULES = ("bound", "bound_2", "tight", "row", "exact_2", "exact_inf")
DIRECTION = np.array([1.0, 0.5, -0.7, 0.3, 0.2, 0.1])
SLOW, FAST = 0.0005, 1.0
"""Sizes of the twist: within the acceleration limits of one step, and far beyond."""
LIMIT = 0.0005
"""Rate limit of the damped schemes [rad/s]: both twists break it, so that the rule works at every step."""
BETWEEN = 10
"""Steps between two resets."""


def schemes() -> dict[str, Any]:
    """Name to scheme; the first one is what the ratios refer to."""
    damped = {
        f"singularity_robust {rule}": {"name": "singularity_robust", "rule": rule, "limit": LIMIT}
        for rule in RULES
    }
    own = {"singularity_robust row, own limits": "singularity_robust"}
    return {"mvn": "mvn", "pseudoinverse": "pseudoinverse", **damped, **own}


def main() -> int:
    """Measures and prints one JSON object."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="few steps: shows that it works")
    chunks, resets = (3, 5) if parser.parse_args().quick else (200, 50)
    robot = ftqp.robots.load("panda")
    runs = {}
    for speed, size in (("slow", SLOW), ("fast", FAST)):
        for name, scheme in schemes().items():
            planner = ftqp.Planner(robot, 1e-3, level="velocity", scheme=scheme, emergency=None)
            q, v = robot.neutral.copy(), np.zeros(7)
            planner.reset(q)
            target = ftqp.Target(pose=robot.pose(q), twist=size * DIRECTION)
            runs[speed, name] = (planner, q, v, target, [])
    for _ in range(chunks):
        for planner, q, v, target, times in runs.values():
            spent = 0.0
            for _ in range(resets):
                planner.reset(q)
                began = time.perf_counter()
                for _ in range(BETWEEN):
                    planner.step(q, v, target)
                spent += time.perf_counter() - began
            times.append(spent / (resets * BETWEEN) * 1e6)
    result: dict[str, Any] = {
        "us": {},
        "ratio_to_qp_same_input": {},
        "ratio_to_cheapest_qp": {},
        "damped": {},
    }
    middle = {key: float(np.median(run[4])) for key, run in runs.items()}
    for (speed, name), us in middle.items():
        key = f"{name}, {speed}"
        planner, q, v, target, _ = runs[speed, name]
        result["us"][key] = round(us, 3)
        result["ratio_to_qp_same_input"][key] = round(us / middle[speed, "mvn"], 3)
        result["ratio_to_cheapest_qp"][key] = round(us / middle["slow", "mvn"], 3)
        planner.reset(q)
        result["damped"][key] = planner.step(q, v, target).kappa > 0.0
    sys.stdout.write(json.dumps(result, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
