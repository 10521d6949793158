"""What one picture of a session needs, as plain numbers; the same from a running arm and from its log."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ftqp.core.checks import FloatArray
from ftqp.core.pose import quaternions
from ftqp.sim.log.further_signals import BODIES, FACTS, PLANES, ROTATION, TASKS, names_in

IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class TwinFacts:
    """The rival at the same tick: the same arm with the same failures, led by damped resolved rates.

    Attributes:
        q: True joint positions, (nv,) [rad or m].
        position_error: How far its tip is from the target [m].
        told: Whether it has been told of all that has failed.
    """

    q: FloatArray
    position_error: float
    told: bool


class Solid(NamedTuple):
    """Something that stands around an arm.

    Attributes:
        kind: ``sphere``, ``capsule``, ``box``, ``cylinder``, ``half_space`` or ``hull``.
        extent: Half its edges; of what is round half its length along z, and its radius; of a hull how far it
            reaches, (3,) [m].
        pose: Where it stands, (16,) [m].
        corners: Of a hull, (3 V,) [m].
    """

    kind: str
    extent: tuple[float, ...]
    pose: tuple[float, ...]
    corners: tuple[float, ...] = ()


class FurtherFact(NamedTuple):
    """A soft task, a point or an axis that is kept somewhere, or something that the arm keeps clear of.

    Attributes:
        name: What it is called.
        value: The task's error, or the distance from the plane, box or cone, positive inside [``unit``].
        unit: ``m`` or ``rad``.
        place: Where the task's target is, or a place on the plane, (3,) [m]; None of one without a place.
        normal: Of a plane, into the side that is free, (3,).
        shape: ``plane``, ``box`` or ``cone``; ``body`` of what stands around the arm; empty of a task.
        corners: Of a box, its lowest and its highest corner, infinite where a side is left out, (6,) [m].
        solid: Of what stands around the arm, what it is; None of the arm itself.
    """

    name: str
    value: float
    unit: str
    place: tuple[float, ...] | None = None
    normal: tuple[float, ...] | None = None
    shape: str = ""
    corners: tuple[float, ...] | None = None
    solid: Solid | None = None


class WayFact(NamedTuple):
    """A way out that was found for the arm, as ``ftqp.Planner.ways_out`` has it.

    Attributes:
        kind: ``back``, ``back by the tip``, ``home``, ``halt`` or ``stop``.
        clear: Whether it can be gone.
        price: What it takes, in a few words.
        sentence: All that there is to say of it.
        q: Postures on the way, from where the arm was to its end, (k, nv) [rad or m].
    """

    kind: str
    clear: bool
    price: str
    sentence: str
    q: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """One tick. What is of the arm equals the columns of a log; what is of the clock a log does not have.

    Attributes:
        tick: Number of the tick.
        t: Its time [s].
        q: True joint positions at its beginning, (nv,) [rad or m].
        v: True joint velocities there, (nv,) [rad/s or m/s].
        truth: What each joint is, (nv,), codes of `ftqp.sim.log.signals.CONDITIONS`.
        belief: What the planner believes of it, (nv,), the same codes.
        target_position: Where the tip should be, (3,) [m].
        target_quaternion: How it should be turned, (4,), x, y, z, w.
        base_position: Where the base is, (3,) [m]; None of a base that stands.
        base_quaternion: How it is turned, (4,), x, y, z, w; None of a base that stands.
        status: Code of the step's status.
        path_status: Code of where the path stands, `ftqp.sim.log.signals.PATH_CODES`.
        position_error: Distance of the tip from its target, over the task's rows [m].
        rotation_error: Angle of the tip from its target, over the task's rows [rad].
        step_time: Wall time of the step [us].
        twin: The rival; None without one, or while a hand leads.
        further: Soft tasks and kept points, in their order.
        ways: Ways out that were found, until one is taken.
        stage: How many times the arm has been replaced by another one.
        paused: Whether time stands.
        speed: Simulated seconds in a second that were asked for.
        pace: Simulated seconds in a second that the machine makes.
        message: The last refusal or note, in plain words; empty without one.
    """

    tick: int
    t: float
    q: FloatArray
    v: FloatArray
    truth: IntArray
    belief: IntArray
    target_position: FloatArray
    target_quaternion: FloatArray
    base_position: FloatArray | None = None
    base_quaternion: FloatArray | None = None
    status: int
    path_status: int
    position_error: float
    rotation_error: float
    step_time: float
    twin: TwinFacts | None = None
    further: tuple[FurtherFact, ...] = ()
    ways: tuple[WayFact, ...] = ()
    stage: int = 0
    paused: bool = False
    speed: float = 1.0
    pace: float = 1.0
    message: str = ""


class Columns(Protocol):
    """The part of a log that facts are read from, such as an `ftqp.sim.log.log_arrays.Log`."""

    @property
    def metadata(self) -> Mapping[str, Any]: ...
    def __getitem__(self, name: str) -> NDArray[Any]: ...
    def __contains__(self, name: object) -> bool: ...


def facts_of(log: Columns, tick: int) -> Facts:
    """The facts of one tick of a log."""
    target, moves = log["target"][tick], "base_status" in log
    base = log["base"][tick] if moves else None
    return Facts(
        tick=tick,
        t=float(log["t"][tick]),
        q=log["q"][tick],
        v=log["v"][tick],
        truth=log["truth"][tick].astype(np.int64),
        belief=log["belief"][tick].astype(np.int64),
        target_position=target[:3],
        target_quaternion=target[3:],
        base_position=None if base is None else base[:3],
        base_quaternion=None if base is None else base[3:],
        status=int(log["status"][tick]),
        path_status=int(log["path_status"][tick]),
        position_error=float(log["position_error"][tick]),
        rotation_error=float(log["rotation_error"][tick]),
        step_time=float(log["step_time"][tick]),
        further=_further(log, tick),
    )


def _further(log: Columns, tick: int) -> tuple[FurtherFact, ...]:
    """Soft tasks, whose targets are shown where they were at first, and kept points of a log."""
    tasks = {
        one["name"]: FurtherFact(one["name"], 0.0, one.get("unit", ""), _three(one.get("place")))
        for one in log.metadata.get(FACTS[TASKS], [])
    }
    tasks |= {name + ROTATION: FurtherFact(name + ROTATION, 0.0, "rad") for name in tasks}
    kept = {
        one["name"]: FurtherFact(
            one["name"],
            0.0,
            one.get("unit", "rad" if one.get("kind") == "cone" else "m"),
            _three(one.get("above")),
            _three(one.get("normal")),
            one.get("kind", "plane"),
            _corners(one.get("inside")),
        )
        for one in log.metadata.get(FACTS[PLANES], [])
    }
    bodies = {
        one["name"]: FurtherFact(one["name"], 0.0, "m", shape="body", solid=_solid(one))
        for one in log.metadata.get(FACTS[BODIES], [])
    }
    return tuple(
        known[name]._replace(value=float(log[f"{group}.{name}"][tick]))
        for group, known in ((TASKS, tasks), (PLANES, kept), (BODIES, bodies))
        for name in names_in(log, log.metadata, group)
    )


def _solid(one: dict[str, Any]) -> Solid | None:
    """What something of a scene is; None of the arm itself."""
    if one["kind"] == "arm":
        return None
    pose, corners = (tuple(np.ravel(one.get(name, ())).tolist()) for name in ("pose", "corners"))
    return Solid(one["kind"], tuple(one["extent"]), pose, corners)


def _corners(inside: Any) -> tuple[float, ...] | None:
    """The corners of a box, of which a log leaves out what is infinite."""
    if inside is None:
        return None
    ends = zip(inside, (-np.inf, np.inf), strict=True)
    return tuple(end if place is None else float(place) for corner, end in ends for place in corner)


def _three(place: Any) -> tuple[float, ...] | None:
    return None if place is None else tuple(map(float, place))


def quaternion_of(pose: FloatArray) -> FloatArray:
    """The quaternion x, y, z, w of a pose, (4,), as a log keeps it."""
    result: FloatArray = quaternions(pose[None, :3, :3])[0]
    return result
