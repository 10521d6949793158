"""From a scenario to the arms of a session: the arm, its rival, and what fails by itself."""

from dataclasses import replace
from pathlib import Path as File
from typing import Any

import numpy as np

from ftqp.app.scenario import document
from ftqp.app.scenario.setup import Setup, resolve, validated
from ftqp.app.schema.reading import Options, options
from ftqp.control.following.goto import GoTo
from ftqp.control.planner.response.detector import Detector
from ftqp.control.scene.solid_shapes import Box
from ftqp.control.task.task import ROW_SETS
from ftqp.core.errors import InputError
from ftqp.model import catalog
from ftqp.model.robot import Robot
from ftqp.model.shape import reach_of
from ftqp.sim.schedule import Schedule
from ftqp.sim.session.session_arms import Choice, SessionArm, SessionArms, SessionLeader, SessionRival

ROUND = 0.06
"""Radius of the circle that an arm of the catalog draws, as a share of its reach."""
LAP = 8.0
"""How long it takes for it [s]."""
BOX, BESIDE, POINTS = 0.15, 0.3, 64
"""Edges of a box beside a path and how far it is from there, as shares of the reach; how many points
of the path are looked at. Conventions."""
REMEMBERED = 20.0
"""The way of the joints is kept for so long, so that a way out can go back on it [s]."""
RANK = 0.02
"""Singular values of the Jacobian below this share of the largest are none."""


def arms_of(choice: Choice, *, rival: bool = True, faults: bool = True) -> SessionArms:
    """The arms of a choice."""
    setup = setup_of(choice, detector=choice.detector)
    if setup.world is not None:
        raise InputError(
            f"scenario {setup.name} has a moving base, which the live page does not move; run it by ftqp run "
            "and view the run's folder"
        )
    return SessionArms(
        title=setup.name,
        robot=setup.robot,
        path=setup.path,
        q=setup.q,
        v=setup.v,
        schedule=setup.schedule if faults else Schedule(),
        arm=_player(setup),
        rival=_rival(setup, choice) if rival else None,
        detects=bool(setup.tables.planner.detector),
        urdf=setup.content["robot"].get("urdf"),
        box=choice.box,
    )


def setup_of(choice: Choice, *, detector: bool | None = None) -> Setup:
    """The scenario with all choices in the place of its own."""
    overrides = list(choice.overrides)
    if choice.backend is not None:
        overrides += ["planner.profile=", f"planner.backend={choice.backend}"]
    if choice.scheme is not None:
        overrides += [f"planner.scheme={choice.scheme}"]
    if choice.plan is not None:
        overrides += [f"planner.plan={File(choice.plan).resolve()}"]
    found = document.read(choice.scenario, overrides)
    if choice.robot is not None:
        found = _with_robot(found, catalog.load(choice.robot), choice.robot)
    tables = validated(found)
    own = tables.planner.detector
    if not (own if detector is None else detector):
        own = False  # a page whose planner gets reports shows what they do
    elif not own:
        own = options(Detector)
    tables = replace(tables, planner=replace(tables.planner, detector=own))
    if choice.box and not tables.scene:
        tables = replace(tables, scene=(_box_beside(resolve(found, tables)),))
    if tables.planner.remember is None:
        tables = replace(tables, planner=replace(tables.planner, remember=REMEMBERED))
    return resolve(found, tables)


def _box_beside(setup: Setup) -> Options[Any]:
    """A box beside the middle of the path, on the side that is away from the arm's base."""
    robot, path = setup.robot, setup.path
    size = reach_of(robot.chain, robot.limits)
    points = path.sample(np.linspace(0.0, path.duration, POINTS)).pose[:, :3, 3]
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    across = np.cross(robot.chain.gravity, middle) if robot.chain.gravity.any() else np.array([0.0, 1.0, 0.0])
    far = float(np.linalg.norm(across))
    across = across / far if far > 0.0 else np.array([0.0, 1.0, 0.0])
    away = float(np.abs((points - middle) @ across).max()) + BESIDE * size
    edge = float(BOX * size)
    return Options(
        Box,
        {"size": (edge, edge, edge), "place": tuple(middle + away * across), "rpy": None, "name": "box"},
        "box",
    )


def _with_robot(found: document.Document, robot: Robot, name: str) -> document.Document:
    """The scenario where it has this arm; else a circle of a twelfth of its reach with its solver."""
    own = found.content.get("robot", {})
    if own == {"name": name}:
        return found
    settings = found.content.get("planner", {})
    kept = {key: settings[key] for key in ("backend", "scheme", "profile") if key in settings}
    radius = ROUND * reach_of(robot.chain, robot.limits)
    content: dict[str, Any] = {
        "robot": {"name": name},
        "planner": kept | {"task": {"rows": _rows(robot)}},
        "path": {"kind": "circle", "radius": radius, "axes": ["x", "y"], "duration": LAP},
    }
    return document.Document(name=name, origin=f"robot {name!r}", folder=found.folder, content=content)


def _rows(robot: Robot) -> Any:
    """The largest task that leaves the arm a joint to spare, or takes all that it has."""
    J = robot.jacobian(robot.neutral)
    moving = int(J.any(axis=0).sum())
    for rows, count in (("pose", 6), ("position", 3)):
        values = np.linalg.svd(J[:count], compute_uv=False)
        if moving > count and values[-1] > RANK * values[0]:
            return rows
    return ["x", "y"]


def _rival(setup: Setup, choice: Choice) -> SessionRival | None:
    """The same arm once more; None where resolved rates cannot lead it, as by torques or by a tool axis."""
    robot = setup.robot
    rows = setup.planner.task.rows or robot.default_rows
    named = ROW_SETS.get(rows) if isinstance(rows, str) else rows
    floats = robot.chain.floating or not robot.is_serial
    if floats or named is None or rows == "position_axis" or setup.plant.drive == "torque":
        return None
    other = setup_of(choice, detector=False)
    return SessionRival(plant=other.plant, sensors=other.sensors, rows=tuple(named))


def _player(setup: Setup) -> SessionArm:
    mean = setup.tables.simulation.feed_forward == "mean"
    if isinstance(setup.follower, GoTo):
        raise InputError(
            "path.reference is 'goal', which has no live page; `ftqp run` runs it, and `ftqp view` shows it"
        )
    leader = SessionLeader(setup.planner, setup.path, setup.follower, mean=mean)
    return SessionArm(setup.planner, leader, setup.plant, setup.sensors)
