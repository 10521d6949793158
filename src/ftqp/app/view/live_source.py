"""A session in a thread of its own, and its frames for a page."""

from dataclasses import replace
from threading import Event, Thread
from time import monotonic
from typing import Final, Self, final

from ftqp.app.scenario import document
from ftqp.app.view.verdicts_file import Verdicts
from ftqp.control.paths import Hold
from ftqp.control.task import schemes
from ftqp.model import catalog
from ftqp.qp import backends as known_backends
from ftqp.sim.session.frame import Frame
from ftqp.sim.session.live_session import Session
from ftqp.sim.session.session_arms import path_points
from ftqp.sim.session.session_commands import Command, Play
from ftqp.viz.live.stage import Stage

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
