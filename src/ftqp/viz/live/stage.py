"""Stage: what of a page stays the same from frame to frame; and what gives both to a page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from ftqp.core.checks import FloatArray, IntArray
from ftqp.model.robot import Robot
from ftqp.sim.session.frame import Frame
from ftqp.sim.session.session_commands import Command


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeatMap:
    """Which failures a motion survives: verdicts (nv, K) at times (K,) [s], with words and colours."""

    joints: tuple[str, ...]
    times: FloatArray
    codes: IntArray
    words: Mapping[int, str]
    colours: Mapping[int, str]
    coverage: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stage:
    """What stays the same until the arm is replaced by another one."""

    number: int  # That of the frames which belong to it, ``Frame.stage``
    title: str  # What is shown, for the head of the page
    robot: Robot
    scheme: str  # Its name
    backend: str  # Its name
    tell: str = "at once"  # How the planner learns of failures, one of `session_commands.TELLS`
    path: FloatArray | None = None  # Points in the frame of the base, (K, 3) [m]; None without one to draw
    urdf: str | None = None  # That the arm was read from, whose meshes can be drawn; None without one
    live: bool = True  # Whether joints can be broken; a replay takes ``Pause``, ``Speed`` and ``Seek`` only
    duration: float | None = None  # The end of a replay [s]; None of a live session
    robots: Sequence[str] = ()  # What ``Use`` takes, none of all four in a replay: robots of the catalog,
    scenarios: Sequence[str] = ()  # bundled scenarios,
    schemes: Sequence[str] = ()
    backends: Sequence[str] = ()  # that are installed
    box: bool = False  # Whether a box was put beside the path
    heat: HeatMap | None = None  # Failures each of which can be a ``Play``; None without a coverage report


class Source(Protocol):
    """The role of what gives a page its frames and takes its commands; any thread may call any method."""

    def frame(self) -> Frame:
        """The latest frame."""

    def stage(self) -> Stage:
        """The stage; that of the latest frame, or a later one."""

    def put(self, command: Command) -> None:
        """Ask for something; it is applied between two ticks, and a refusal is the ``message`` of a frame."""
