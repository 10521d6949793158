"""``ftqp converge``: where an arm ends up that does not know of its locked joint, and why."""

from pathlib import Path
from typing import Any

import numpy as np

from ftqp.analysis import (
    CircularIntervals,
    LearnedRun,
    Outcome,
    joint_ranges,
    learned_run,
    outcome,
    reachable_after,
    rest_configurations,
)
from ftqp.app.output.console import ExitCode, Shown, Table, answer, json_text, say
from ftqp.app.run.runs import SUMMARY, make_folder, write
from ftqp.app.scenario.setup import Setup
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, MissingPackage, ScenarioError
from ftqp.faults.kinds import Locked

PICTURE = "motion.png"
MEANINGS = {
    "correct": "it arrives at the goal",
    "erroneous": "it comes to rest away from the goal",
    "none": "it does not come to rest",
    "singular": "it is taken in by a singularity",
    "unresolved": "no verdict",
}
"""What each kind of outcome means."""
LEARNING = 60.0
"""The law that learns is given so long [s]."""
CROSS = 0.15
"""Half the size of the cross that marks the goal, in characteristic lengths."""


def converge(setup: Setup, folder: Path, *, as_json: bool) -> ExitCode:
    """Explain one motion to a goal on which joints lock that nobody knows of."""
    setup.refuse_tables("ftqp converge", "constraints", "scene")
    robot, rows = setup.robot, setup.planner.task_rows
    joints, share = _locks(setup)
    goal = setup.path.sample(np.array([setup.path.duration])).pose[-1]
    found = outcome(robot, goal, setup.q, joints, rows=rows, at=share)
    begins = found.path[0]
    values: dict[str, float] = {joint: float(begins[robot.joint(joint)]) for joint in joints}
    learned = learned_run(robot, goal, begins, joints, rows=rows, duration=LEARNING)
    ranges = _ranges(setup, goal)
    facts: dict[str, Any] = {
        "scenario": setup.name,
        "robot": robot.name,
        "rows": list(rows),
        "goal": goal[:3, 3].tolist(),
        "locked": values,
        "locked_at_share": share,
        "kind": found.kind,
        "reason": found.reason,
        "error": found.error,
        "q": found.q.tolist(),
        "rate": found.rate,
        "period": found.period,
        "error_range": found.error_range,
        "goal_within_reach": reachable_after(robot, goal, dict(values.items()), rows=rows),
        "ranges": None if ranges is None else {name: one.intervals for name, one in ranges.items()},
        "rests": _rests(setup, goal, values),
        "learned": {"error": learned.error, "theta": dict(zip(robot.joints, learned.theta, strict=True))},
        "folder": str(folder),
    }
    make_folder(folder)
    facts["figure"] = _picture(setup, goal, found, learned, folder)
    write(folder / SUMMARY, json_text(facts))
    answer(facts, as_json, _shown(facts))
    return ExitCode.DONE if found.kind == "correct" else ExitCode.STOPPED


def _locks(setup: Setup) -> tuple[list[str], float]:
    """Names of the joints that lock, and the share of the straight way that is done by then."""
    events = list(setup.schedule)
    if not events:
        raise ScenarioError(
            f"{setup.name} has no faults; ftqp converge explains what becomes of a motion on which a joint "
            "locks, so give it [[faults]] with kind = 'locked'"
        )
    other = next((event.fault for event in events if not isinstance(event.fault, Locked)), None)
    if other is not None:
        raise ScenarioError(
            f"{other.joint} of {setup.name} {other.happens}, expected joints that lock; ftqp converge "
            "knows no other faults"
        )
    times = {event.at for event in events}
    if len(times) > 1:
        raise ScenarioError(
            f"the joints of {setup.name} lock at {sorted(times)} s, expected one time for all"
        )
    at = min(times.pop(), setup.path.duration)
    poses = setup.path.sample(np.array([0.0, at, setup.path.duration])).pose[:, :3, 3]
    whole = float(np.linalg.norm(poses[2] - poses[0]))
    share = float(np.linalg.norm(poses[1] - poses[0])) / whole if whole else 0.0
    return [setup.robot.joints[setup.robot.joint(event.fault.joint)] for event in events], min(share, 1.0)


def _ranges(setup: Setup, goal: FloatArray) -> dict[str, CircularIntervals] | None:
    """The values of each joint with which the goal is within reach; None of a goal that never is."""
    try:
        return joint_ranges(setup.robot, goal, rows=setup.planner.task_rows)
    except InputError:
        return None


def _rests(setup: Setup, goal: FloatArray, values: dict[str, float]) -> list[dict[str, Any]] | None:
    """The rests away from the goal with this lock; None where several joints lock, or none is to spare."""
    if len(values) > 1 or setup.robot.nv <= len(setup.planner.task_rows):
        return None
    ((joint, value),) = values.items()
    found = rest_configurations(setup.robot, goal, joint, value, rows=setup.planner.task_rows)
    return [
        {"kind": str(rest.kind), "error": rest.error, "q": rest.q.tolist()}
        for rest in sorted(found, key=lambda rest: rest.error)
    ]


def _picture(setup: Setup, goal: FloatArray, found: Outcome, learned: LearnedRun, folder: Path) -> str | None:
    """The picture's file; None, said in words, where nothing can draw."""
    try:
        from ftqp.viz.figures.loop_picture import draw_loop
    except MissingPackage as error:
        say(f"no picture: {error}")
        return None
    errors = {
        f"the law as it is: {found.kind}": (found.t, found.errors),
        "the law that learns": (learned.t, learned.errors),
    }
    cross = goal[:3, 3] + CROSS * setup.robot.length * np.stack([-np.eye(3), np.eye(3)], axis=1)
    title = f"{setup.name}: the law as it is, with a lock that nobody notices (cross: the goal)"
    panels = {"distance from the goal [m]": errors}
    return str(
        draw_loop(folder / PICTURE, title, panels, arm=(setup.robot, found.path), edges=cross),
    )


def _shown(facts: dict[str, Any]) -> Shown:
    """The facts as sentences and tables."""
    locks = ", ".join(f"{joint} at {np.rad2deg(value):.4g} deg" for joint, value in facts["locked"].items())
    goal = ", ".join(f"{x:.4g}" for x in facts["goal"])
    shown: list[str | Table] = [
        f"{facts['scenario']}: {facts['robot']}, rows {', '.join(facts['rows'])}, goal ({goal}) m; "
        f"locks {locks}, {100.0 * facts['locked_at_share']:.0f} % of the way done, and nobody notices",
        f"  {facts['kind']}: {MEANINGS[facts['kind']]}. {facts['reason']}",
        f"  the goal is {'within' if facts['goal_within_reach'] else 'out of'} reach of the other joints",
        f"  it ends {1e3 * facts['error']:.4g} mm from the goal; a law that learns which joint does nothing "
        f"ends {1e3 * facts['learned']['error']:.4g} mm from it",
    ]
    if facts["rate"] is not None:
        shown.append(f"  at last the error falls with {abs(facts['rate']):.3g} 1/s at a gain of 1 1/s")
    if facts["ranges"] is not None:
        rows = [
            (name, ", ".join(_interval(low, high) for low, high in intervals) or "nowhere")
            for name, intervals in facts["ranges"].items()
        ]
        shown.append(Table("The goal stays within reach with", ("joint", "locked in deg at"), rows))
    if facts["rests"]:
        heads = ("kind", "error in mm", "joints in deg")
        rests = [
            (one["kind"], f"{1e3 * one['error']:.4g}", ", ".join(f"{x:.2f}" for x in np.rad2deg(one["q"])))
            for one in facts["rests"]
        ]
        shown.append(Table("Rests away from the goal", heads, rests, heads[1:2]))
    return [*shown, f"  files: {facts['folder']}"]


def _interval(low: float, high: float) -> str:
    return "all" if high - low > 2.0 * np.pi - 1e-9 else f"{np.rad2deg(low):.4f} to {np.rad2deg(high):.4f}"
