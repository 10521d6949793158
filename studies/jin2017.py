"""Jin et al. 2017 made again: a planar arm of six links draws a square while joints lock.

E1 has no fault, in E2 joint 1 locks at 15 s, in E3 joints 1 to 5 do; E4 is the same at the velocity level.
The settings are those of the bundled scenario planar6-square.

    python studies/jin2017.py [--quick] [--out DIR] [--json]
    python studies/jin2017.py --figures DIR [--only E2]

Seconds on one core. Quick leaves the velocity level out. The report and its pictures go to studies/results.
"""

import sys
from functools import partial
from typing import Any

import numpy as np
from papers.beside import Found, Row, Sheet, draw_loop, publish

from ftqp.app.scenario.setup import load

LOCK = '{{kind="locked", joint={}, at=15.0, mode="instant", reset="kinematic"}}'
CASES = {
    "E1": ("no fault", ()),
    "E2": ("joint 1 locked from 15 s", (0,)),
    "E3": ("joints 1 to 5 locked from 15 s", range(5)),
}
STOP = "{position=0.01, rotation=1.0, samples=1}"
"""When the paper stops: at the first rise beyond 0.01 m."""


def run(joints: Any, *more: str) -> Any:
    """The result of one case, with its log."""
    faults = ", ".join(LOCK.format(joint) for joint in joints)
    choices = [f"faults=[{faults}]", f"planner.emergency={STOP}", *more]
    return load("planar6-square", choices).simulation(log="memory").run()


def said(result: Any) -> str:
    """How a run ended, in the words of the table."""
    error = f"end effector off its path by at most {result.log['position_error'].max():.3g} m"
    return error if result.stopped_at is None else f"stop at {result.stopped_at:.2f} s"


PUBLISHED = {"E1": "torque curves", "E2": "below 4e-6 m", "E3": "stop near 16 s"}


def sheet(name: str) -> Sheet:
    """Joint velocities, torques and the tip's error of a case."""
    result = run(CASES[name][1])
    values = {"most": float(result.log["position_error"].max()), "stopped": result.stopped_at}
    return Sheet(said(result), values, lambda file, _: picture(name, result, file))


def work(quick: bool) -> Found:
    """All cases, and their figures."""
    runs = {name: run(joints) for name, (_, joints) in CASES.items()}
    rows = [Row(f"{name}, {CASES[name][0]}", PUBLISHED[name], said(result)) for name, result in runs.items()]
    two = runs["E2"].log
    late = two["t"] > 15.0 + 2 * 0.01
    still = max(float(np.abs(two[name][late, 0]).max()) for name in ("v", "a"))
    rows.append(Row("E2, velocity and acceleration of joint 1 after the lock", "zero", f"at most {still:g}"))
    if not quick:
        for words, joints in CASES.values():
            result = run(joints, "planner.level=velocity", "planner.task.kv=")
            rows.append(Row(f"E4, velocity level, {words}", "", said(result)))
    pictures = {name: partial(picture, name, result) for name, result in runs.items()}
    return Found(rows, {f"{name}": draw for name, draw in pictures.items()})


def picture(name: str, result: Any, file: Any) -> None:
    """Joint velocities, torques and the tip's error of a case."""
    log = result.log
    t = log["t"]
    curves = {
        label: {f"joint {i + 1}": (t, values) for i, values in enumerate(log[signal].T)}
        for label, signal in (("velocities [rad/s]", "v"), ("torques [N m]", "tau"))
    }
    curves["off its path [m]"] = {"error": (t, np.maximum(log["position_error"], 1e-9))}
    fault = None if name == "E1" else (15.0, CASES[name][0])
    title = f"{name}: {CASES[name][0]}"
    draw_loop(file, title, curves, logarithmic=["off its path [m]"], fault=fault)


if __name__ == "__main__":
    sheets = {name: partial(sheet, name) for name in CASES}
    sys.exit(publish("jin2017", "Jin et al. 2017, made again", __doc__ or "", "jin2017.md", work, sheets))
