"""A session in a thread of its own, and its frames for a page."""

from dataclasses import replace
from threading import Event, Thread
from time import monotonic
from typing import Any, Final, Self, final

import numpy as np

from ftqp.app.scenario import document
from ftqp.app.scenario.setup import Setup, chosen, resolve, validated
from ftqp.app.schema.reading import Options, options
from ftqp.app.view.verdicts_file import Verdicts
from ftqp.control.following.goto import GoTo
from ftqp.control.paths import Hold
from ftqp.control.planner.detector import Detector
from ftqp.control.scene.solid_shapes import Box
from ftqp.control.task import schemes
from ftqp.control.task.task import ROW_SETS
from ftqp.core.errors import InputError
from ftqp.model import catalog
from ftqp.model.robot import Robot
from ftqp.model.shape import reach_of
from ftqp.qp import backends as known_backends
from ftqp.sim.schedule import Schedule
from ftqp.sim.session.frame import Frame
from ftqp.sim.session.live_session import Session
from ftqp.sim.session.session_arms import (
    Choice,
    SessionArm,
    SessionArms,
    SessionLeader,
    SessionRival,
    path_points,
)
from ftqp.sim.session.session_commands import Command, Play
from ftqp.viz.live.stage import Stage

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
    choices = chosen(choice.overrides, choice.backend, choice.scheme, choice.plan)
    found = document.read(choice.scenario, choices)
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


PICTURES: Final = 30.0
"""Pictures of a second: between two of them the session makes its ticks without a pause."""
SMOOTH: Final = 0.1
"""Share of the latest picture in the pace that is shown."""


@final
class LiveSource:
    """Steps a session by the clock, and keeps its latest frame for a page.

    A picture advances the session by its speed over the pictures of a second. Where the machine is slower,
    time goes slower, and ``pace`` says by how much: no tick is skipped, and what was missed is not made up.
    Nothing but this object's thread steps the session; failures of a report can be played.
    """

    def __init__(self, session: Session, *, report: Verdicts | None = None) -> None:
        self._session, self._report = session, report
        self._over = Event()
        self._thread = Thread(target=self._run, name="ftqp session", daemon=True)
        self._stage, self._frame = stage_of(session, report), session.frame

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def frame(self) -> Frame:
        """The latest frame."""
        return self._frame

    def stage(self) -> Stage:
        """The stage of the latest frame, or a later one."""
        return self._stage

    def put(self, command: Command) -> None:
        """Ask for something; it is applied between two ticks."""
        if isinstance(command, Play) and self._report is not None:
            command = replace(command, kind=self._report.kind, settings=self._report.settings)
        self._session.put(command)

    def _run(self) -> None:
        """Advance picture by picture until it is over."""
        session, period = self._session, 1.0 / PICTURES
        before = due = monotonic()
        while not self._over.is_set():
            wanted = session.speed * period
            dt = session.arms.arm.planner.dt
            made = session.advance(wanted)
            now = monotonic()
            if made:
                reached = made * dt / max(now - before, period)
                session.pace += SMOOTH * (min(reached, session.speed) - session.pace)
            before = now
            self._publish()
            due = max(due + period, monotonic() - period)
            self._over.wait(max(due - monotonic(), 0.0))

    def _publish(self) -> None:
        """Hand the frame to whoever draws; the stage first, because a frame names it."""
        session = self._session
        if session.stage != self._stage.number or session.tell != self._stage.tell:
            self._stage = stage_of(session, self._report)
        self._frame = session.frame


def stage_of(session: Session, report: Verdicts | None = None) -> Stage:
    """The stage of the arms of a session; failures of a report can be played on the first."""
    arms = session.arms
    report = None if session.stage else report
    return Stage(
        number=session.stage,
        title=arms.title if report is None else f"{report.name}, failures of its motion",
        robot=arms.robot,
        scheme=arms.arm.planner.scheme.name,
        backend=arms.arm.planner.backend,
        tell=session.tell,
        path=None if isinstance(arms.path, Hold) else path_points(arms.path),
        urdf=arms.urdf,
        robots=tuple(catalog.names()),
        scenarios=tuple(document.bundled()),
        schemes=tuple(schemes.names()),
        backends=tuple(info.name for info in known_backends() if info.available),
        box=arms.box,
        heat=None if report is None else report.heat,
    )
