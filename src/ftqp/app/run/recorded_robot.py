"""What a log says of its run: what to know before reading on, its scenario, and the arm, made anew."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ftqp import __version__
from ftqp.app.scenario.setup import arm_from
from ftqp.app.schema.reading import read
from ftqp.app.schema.robot_section import RobotTable
from ftqp.core.errors import FtqpError, InputError, ScenarioError
from ftqp.model import catalog
from ftqp.model.robot import Robot
from ftqp.sim.log.log_rows import LogRows

FAR = 1e9
"""No joint and no tip is beyond this [rad or m]."""
NEAR = 1e-6
"""The tip of the arm and that of the log may be so far apart [m]: the log's comes from compiled formulas."""


def notes_of(about: Mapping[str, Any], end: float) -> list[str]:
    """What to know of a log that ends then [s]: it was cut short, or made by another version."""
    notes, state = [], about.get("state", "finished")
    if state == "running":
        notes.append(f"The log was cut short: it ends at {end:.3f} s, as far as it was written.")
    elif state != "finished":
        why = about.get("broken")
        notes.append(f"The run was {state!s:.40} at {end:.3f} s{f': {why}' if why else ''}.")
    made = (about.get("versions") or {}).get("ftqp", __version__)
    if made != __version__:
        notes.append(f"The run was made by ftqp {made!s:.40}, this is {__version__}.")
    return notes


def scenario_of(about: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of the scenario of a log; none where it has none."""
    text = about.get("resolved")
    return tomllib.loads(text) if isinstance(text, str) else {}


def recorded_robot(rows: LogRows) -> tuple[Robot | None, str]:
    """The arm of a run and an empty text, or None and a sentence that says why it is not known.

    The scenario in the log names it; a run without one may be of a robot of the catalog. An arm whose tip
    is not where the log says, because its file has changed since, is not that of the run.
    """
    try:
        robot = _made(rows)
    except (FtqpError, ValueError) as error:
        return None, f"the arm of {rows.title} cannot be made: {str(error).splitlines()[0]:.300}"
    if robot is None:
        return None, f"{rows.title} does not say which arm it is of"
    joints = tuple(rows.metadata.get("joints") or ())
    if robot.joints != joints:
        return None, f"{rows.title} has the joints {', '.join(joints)!s:.200}, {robot.name} has others"
    off = _distance(rows, robot)
    if not off <= NEAR:
        return None, (
            f"the end effector of {robot.name} is {off:.3g} m from where {rows.title} has it; the arm has "
            "changed since the run"
        )
    return robot, ""


def _made(rows: LogRows) -> Robot | None:
    """The arm of the log's scenario, or else of the catalog; None where neither names it."""
    if scenario := scenario_of(rows.metadata):
        try:
            given = read(RobotTable, scenario.get("robot"), "the robot has errors:", "robot")
        except ScenarioError as error:
            raise InputError("; ".join(error.errors)) from error
        return arm_from(given, Path())
    name = rows.metadata.get("robot")
    if isinstance(name, str) and name.partition("(")[0] in catalog.names():
        return catalog.load(name)
    return None


def _distance(rows: LogRows, robot: Robot) -> float:
    """How far the tip is from the log's first one [m]; on a moving base, how wrong its distance is."""
    groups, first = rows.groups(), next(rows.blocks(), None)
    if first is None or not {"q", "tip"} <= groups.keys():
        return float("nan")
    q, tip = first[0, groups["q"]], first[0, groups["tip"]][:3]
    if not (np.abs([*q, *tip]) < FAR).all():
        return float("nan")
    there = robot.pose(q)[:3, 3]
    if "base" not in groups:
        return float(np.linalg.norm(there - tip))
    return float(abs(np.linalg.norm(there) - np.linalg.norm(tip - first[0, groups["base"]][:3])))
