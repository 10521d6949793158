"""What one picture of a session needs, as plain numbers; the same from a running arm and from its log."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ftqp.core.checks import FloatArray
from ftqp.core.pose import quaternions
from ftqp.sim.log.signals import BODIES, FACTS, PLANES, ROTATION, TASKS, names_in

IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class TwinFacts:
    """The rival at the same tick: the same arm with the same failures, led by damped resolved rates."""

    q: FloatArray  # True joint positions, (nv,) [rad or m]
    position_error: float  # How far its tip is from the target [m]
    told: bool  # Whether it has been told of all that has failed


class Solid(NamedTuple):
    """Something that stands around an arm."""

    kind: str  # ``sphere``, ``capsule``, ``box``, ``cylinder``, ``half_space`` or ``hull``
    # Half its edges; of what is round half its length along z, and its radius; of a hull how far it reaches,
    # (3,) [m]
    extent: tuple[float, ...]
    pose: tuple[float, ...]  # Where it stands, (16,) [m]
    corners: tuple[float, ...] = ()  # Of a hull, (3 V,) [m]


class FurtherFact(NamedTuple):
    """A soft task, a point or an axis that is kept somewhere, or something that the arm keeps clear of."""

    name: str  # What it is called
    value: float  # The task's error, or the distance from the plane, box or cone, positive inside [``unit``]
    unit: str  # ``m`` or ``rad``
    # Where the task's target is, or a place on the plane, (3,) [m]; None of one without a place
    place: tuple[float, ...] | None = None
    normal: tuple[float, ...] | None = None  # Of a plane, into the side that is free, (3,)
    shape: str = ""  # ``plane``, ``box`` or ``cone``; ``body`` of what stands around the arm; empty of a task
    # Of a box, its lowest and its highest corner, infinite where a side is left out, (6,) [m]
    corners: tuple[float, ...] | None = None
    solid: Solid | None = None  # Of what stands around the arm, what it is; None of the arm itself


class WayFact(NamedTuple):
    """A way out that was found for the arm, as ``ftqp.Planner.ways_out`` has it."""

    kind: str  # ``back``, ``back by the tip``, ``home``, ``halt`` or ``stop``
    clear: bool  # Whether it can be gone
    price: str  # What it takes, in a few words
    sentence: str  # All that there is to say of it
    q: FloatArray  # Postures on the way, from where the arm was to its end, (k, nv) [rad or m]


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """One tick. What is of the arm equals the columns of a log; what is of the clock a log does not have."""

    tick: int  # Number of the tick
    t: float  # Its time [s]
    q: FloatArray  # True joint positions at its beginning, (nv,) [rad or m]
    v: FloatArray  # True joint velocities there, (nv,) [rad/s or m/s]
    truth: IntArray  # What each joint is, (nv,), codes of `ftqp.sim.log.signals.CONDITIONS`
    belief: IntArray  # What the planner believes of it, (nv,), the same codes
    target_position: FloatArray  # Where the tip should be, (3,) [m]
    target_quaternion: FloatArray  # How it should be turned, (4,), x, y, z, w
    base_position: FloatArray | None = None  # Where the base is, (3,) [m]; None of a base that stands
    # How it is turned, (4,), x, y, z, w; None of a base that stands
    base_quaternion: FloatArray | None = None
    status: int  # Code of the step's status
    path_status: int  # Code of where the path stands, `ftqp.sim.log.signals.PATH_CODES`
    position_error: float  # Distance of the tip from its target, over the task's rows [m]
    rotation_error: float  # Angle of the tip from its target, over the task's rows [rad]
    step_time: float  # Wall time of the step [us]
    twin: TwinFacts | None = None  # The rival; None without one, or while a hand leads
    further: tuple[FurtherFact, ...] = ()  # Soft tasks and kept points, in their order
    ways: tuple[WayFact, ...] = ()  # Ways out that were found, until one is taken
    stage: int = 0  # How many times the arm has been replaced by another one
    paused: bool = False  # Whether time stands
    speed: float = 1.0  # Simulated seconds in a second that were asked for
    pace: float = 1.0  # Simulated seconds in a second that the machine makes
    message: str = ""  # The last refusal or note, in plain words; empty without one


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
        further=further_facts(
            log.metadata,
            {
                f"{group}.{name}": float(log[f"{group}.{name}"][tick])
                for group in FACTS
                for name in names_in(log, log.metadata, group)
            },
        ),
    )


def further_facts(about: Mapping[str, Any], values: Mapping[str, float]) -> tuple[FurtherFact, ...]:
    """Soft tasks, kept points and scene, of the metadata of a log and the values of its signals by name."""
    tasks = {
        one["name"]: FurtherFact(one["name"], 0.0, one.get("unit", ""), _three(one.get("place")))
        for one in about.get(FACTS[TASKS], [])
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
        for one in about.get(FACTS[PLANES], [])
    }
    bodies = {
        one["name"]: FurtherFact(one["name"], 0.0, "m", shape="body", solid=_solid(one))
        for one in about.get(FACTS[BODIES], [])
    }
    return tuple(
        known[name]._replace(value=values[f"{group}.{name}"])
        for group, known in ((TASKS, tasks), (PLANES, kept), (BODIES, bodies))
        for name in names_in(values, about, group)
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
