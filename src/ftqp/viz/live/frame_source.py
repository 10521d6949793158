"""What a page shows: the role of a source of frames, and the stage on which they play."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from ftqp.core.checks import FloatArray
from ftqp.model.robot import Robot
from ftqp.sim.session.session_commands import Command
from ftqp.sim.session.tick_facts import IntArray
from ftqp.viz.live.frame import Frame


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeatMap:
    """Which failures a motion survives, for a picture that can be clicked: ``coverage`` of them, from 0 to 1.

    Codes are the verdicts, (nv, K), on a failure of each joint at each time, (K,) [s]; each has words and a
    colour, ``#rrggbb``.
    """

    joints: tuple[str, ...]
    times: FloatArray
    codes: IntArray
    words: Mapping[int, str]
    colours: Mapping[int, str]
    coverage: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stage:
    """What stays the same from frame to frame until the arm is replaced by another one.

    Attributes:
        number: That of the frames which belong to it, ``Frame.stage``.
        title: What is shown, for the head of the page.
        robot: The arm.
        scheme: Name of the scheme.
        backend: Name of the backend.
        tell: How the planner learns of failures, one of `ftqp.sim.session.session_commands.TELLS`.
        path: Points of the path in the frame of the base, (K, 3) [m]; None where there is none to draw.
        urdf: The URDF that the arm was read from, whose meshes can be drawn; None of an arm without one.
        live: Whether joints can be broken; a replay takes ``Pause``, ``Speed`` and ``Seek`` only.
        duration: The end of a replay [s]; None of a live session.
        robots: Catalog robots that ``Use`` takes; none in a replay.
        scenarios: Bundled scenarios that ``Use`` takes; none in a replay.
        schemes: Schemes that ``Use`` takes; none in a replay.
        backends: Backends that ``Use`` takes and that are installed; none in a replay.
        box: Whether a box was put beside the path.
        heat: Which failures the motion survives, each of which can be a ``Play``; None without a coverage
            report.
    """

    number: int
    title: str
    robot: Robot
    scheme: str
    backend: str
    tell: str = "at once"
    path: FloatArray | None = None
    urdf: str | None = None
    live: bool = True
    duration: float | None = None
    robots: Sequence[str] = ()
    scenarios: Sequence[str] = ()
    schemes: Sequence[str] = ()
    backends: Sequence[str] = ()
    box: bool = False
    heat: HeatMap | None = None


class Source(Protocol):
    """The role of what gives a page its frames and takes its commands; any thread may call any method."""

    def frame(self) -> Frame:
        """The latest frame."""

    def stage(self) -> Stage:
        """The stage; that of the latest frame, or a later one."""

    def put(self, command: Command) -> None:
        """Ask for something; it is applied between two ticks, and a refusal is the ``message`` of a frame."""
