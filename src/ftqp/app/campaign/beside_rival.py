"""Episodes judged by what a user sees of the arm: ftqp, and damped least squares."""

import copy
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, final

import numpy as np

from ftqp.app.scenario.setup import Setup
from ftqp.control.drive.computed_torque import ComputedTorque
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.planner_view import JointState
from ftqp.core.checks import FloatArray
from ftqp.core.pose import rotation_vector
from ftqp.model.robot import Robot
from ftqp.sim.loop import LONGEST, MEMORY
from ftqp.sim.plants.plant import Command, Plant, PlantAround
from ftqp.sim.rival import ResolvedRates, Rival, ride

WHO: Final = ("ftqp", "rival")
"""Who leads the arm of an episode: ftqp as its campaign makes it, and least squares."""
GAIN: Final = 5.0
"""Feedback of the rival, K [1/s]: with a lag T of 0.12 s, about the longest that is drawn, its loop has the
damping ratio 1/(2 sqrt(K T)) = 0.65."""
FILTER: Final = 300.0
"""Pole behind which the rival differentiates samples for torques [1/s]: 3.3 ms, with 1 ms of delay, 1 ms of
latency and half a period 6 ms, times the law's 40 1/s the 0.24 that it may have."""
FAST, AHEAD = 1.02, 0.02
"""Limits are broken beyond this share of a speed limit, or so far out of range [rad or m], as in physics."""
LEAPS: Final = 1.1
"""After a hold a joint leaps beyond this share of its speed limit, or of its greatest speed before."""
NEAR, TURNED = 0.01, 0.1
"""How near to its target a tip has to end [m] and [rad]."""
WRAPS: Final = 1e-6
"""An encoder that is off by whole turns, to so many turns, has wrapped, and its joint is healthy."""
MATTERS, WITHIN = 0.02, 2.0
"""A lock matters if the healthy joint would have gone this far [rad or m] in so many seconds."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Events:
    """What really happens in an episode."""

    since: FloatArray  # When each joint stops following, inf: never, (nv,) [s]
    doubted: FloatArray  # When each joint, its encoder included, is no longer healthy, (nv,) [s]
    locks: tuple[tuple[int, float], ...]  # Joints that lock, and when [s]; those that nobody reports
    holds: tuple[tuple[float, float], ...]  # When all joints are held, and let go [s]

    @property
    def healthy(self) -> bool:
        """Whether no joint fails."""
        return bool(np.isinf(self.doubted).all())

    @classmethod
    def of(cls, setup: Setup) -> "Events":
        """Those of an episode."""
        robot, tables = setup.robot, setup.tables
        since = np.full(robot.nv, np.inf)
        locks = []
        for one in tables.faults:
            i = robot.joint(one.joint)
            since[i] = min(since[i], one.at)
            if one.kind.kind == "locked" and one.announced == "never":
                locks.append((i, one.at))
        doubted = since.copy()
        for trouble in tables.simulation.troubles:
            if trouble.joint is None:
                continue
            i = robot.joint(trouble.joint)
            doubted[i] = min(doubted[i], trouble.at)
            if trouble.kind.kind != "misread":
                since[i] = min(since[i], trouble.at)
            if trouble.kind.kind == "jammed" and trouble.duration is None and trouble.kind["share"] is None:
                locks.append((i, trouble.at))
        sensors = tables.sensors
        for fault in () if sensors is None else sensors["faults"]:
            turns = fault.values.get("size", 0.0) / (2.0 * np.pi)
            if fault["joint"] is not None and (turns == 0.0 or abs(turns - round(turns)) > WRAPS):
                i = robot.joint(fault["joint"])
                doubted[i] = min(doubted[i], fault["at"])
        holds = tuple((one["at"], one["at"] + one["duration"]) for one in tables.simulation.holds)
        return cls(since=since, doubted=doubted, locks=tuple(locks), holds=holds)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Led:
    """What an arm did, each row a tick, and what was said of it."""

    t: FloatArray  # Time, (K,) [s]
    q: FloatArray  # Where its joints truly were, (K, nv) [rad or m]
    v: FloatArray  # Their true velocities, (K, nv) [rad/s or m/s]
    named: Mapping[int, float]  # Joints that were believed to have failed or were braked, and when first [s]
    stopped: str | None = None  # Why a stop was latched, or None


@final
class WatchedPlant(PlantAround):
    """A plant that notes how its joints move, and which are believed to have failed or braked alone."""

    __slots__ = ("_healthy", "_motion", "_planner", "named")

    def __init__(self, plant: Plant, planner: Planner, reported: Collection[int], ticks: int) -> None:
        super().__init__(plant)
        self._planner = planner
        self._healthy = set(range(planner.robot.nv)) - set(reported)
        self._motion = np.empty((ticks, 2, planner.robot.nv))
        self.named: dict[int, float] = {}

    @property
    def motion(self) -> FloatArray:
        """Positions and velocities at every tick, (K, 2, nv)."""
        return self._motion[: self._tick]

    def reset(self, q: FloatArray, v: FloatArray) -> None:
        super().reset(q, v)
        self.named.clear()

    def advance(self, command: Command) -> None:
        self._motion[self._tick] = self._plant.q, self._plant.v
        brakes = command.brakes
        blamed = set(map(self._planner.robot.joint, self._planner.faults))
        if brakes.any() and not brakes.all():
            blamed |= set(map(int, np.flatnonzero(brakes)))
        for i in blamed & self._healthy:
            self.named.setdefault(i, self._tick * self._planner.dt)
        super().advance(command)


def led_by_ftqp(setup: Setup) -> Led:
    """What the arm of an episode does under its planner."""
    planner, dt = setup.planner, setup.planner.dt
    reported = [setup.robot.joint(one.fault.joint) for one in setup.schedule if one.reported_at is not None]
    most = setup.duration or LONGEST * setup.path.duration
    watched = WatchedPlant(setup.plant, planner, reported, round(most / dt) + 1)
    ended = replace(setup, plant=watched).simulation().run()
    if ended.interrupted:
        raise KeyboardInterrupt
    q, v = np.moveaxis(watched.motion, 1, 0)
    stopped = None if ended.stopped_at is None else planner.stopped_because or "stopped"
    t = np.asarray(dt * np.arange(len(q)), dtype=np.float64)
    return Led(t=t, q=q, v=v, named=dict(watched.named), stopped=stopped)


@final
class TorqueRates:
    """Damped least squares above a computed-torque law that knows the rotors and no load, for torque arms."""

    def __init__(self, rates: ResolvedRates, geared: Robot, dt: float) -> None:
        self._rates, self._law, self._dt = rates, ComputedTorque(geared), dt
        self._rest = np.zeros(geared.nv)
        self._last, self._v = self._rest.copy(), self._rest.copy()
        self.tau, self.brakes = self._rest, np.zeros(geared.nv, dtype=np.bool_)
        self.q, self.v = rates.q, rates.v

    def reset(self, q: FloatArray) -> None:
        """Begin at rest at q, (nv,)."""
        self._rates.reset(q)
        self._last, self._v = np.array(q), self._rest.copy()

    def tell(self, joint: str | int) -> None:
        """From now on that joint is known to have failed."""
        self._rates.tell(joint)

    def step(self, q: FloatArray, pose: FloatArray, twist: FloatArray) -> "TorqueRates":
        """One tick; the command is what the controller then holds."""
        led = self._rates.step(q, pose, twist)
        self._v = self._v - np.expm1(-FILTER * self._dt) * ((q - self._last) / self._dt - self._v)
        self._last = np.array(q)
        self.tau = self._law.torques(JointState(led.q, led.v, self._rest), q, self._v)
        return self


def led_by_rival(setup: Setup) -> Led:
    """What the arm of an episode does under damped least squares, which gets what is reported."""
    robot, dt = setup.robot, setup.planner.dt
    reported = [one.reported_at is not None for one in setup.schedule]
    rates = ResolvedRates(robot, dt, rows=setup.planner.task_rows, gain=GAIN)
    rival: Rival = rates
    if setup.plant.drive == "torque":
        rival = TorqueRates(rates, setup.tables.simulation.mujoco.true_arm().geared(robot), dt)
    done = ride(
        rival, robot, setup.path, setup.q, dt=dt, plant=setup.plant, sensors=setup.sensors,
        schedule=setup.schedule, reported=bool(reported) and all(reported),
        duration=setup.duration or setup.path.duration,
    )  # fmt: skip
    return Led(t=done.t, q=done.q, v=done.v, named={})


def judged(setup: Setup, events: Events, led: Led, ideal: FloatArray | None) -> dict[str, Any]:
    """What a user sees of an arm that was led; ``ideal`` is how its joints go where nothing lags or fails."""
    robot, limits, t = setup.robot, setup.robot.limits, led.t
    obeys = t[:, None] < events.since
    fast = np.where(obeys, np.abs(led.v) / limits.v_max, 0.0)
    far = np.where(obeys, np.maximum(led.q - limits.q_max, limits.q_min - led.q), -np.inf)
    leap = 0.0
    for begin, end in events.holds:
        before, after = fast[t < begin], fast[t >= end]
        if len(before) and len(after):
            leap = max(leap, float((after.max(axis=0) / np.maximum(1.0, before.max(axis=0))).max()))
    end_pose = robot.pose(np.clip(led.q[-1], -1e6, 1e6))
    goal = setup.path.sample(np.array([setup.path.duration])).pose[0]
    off = float(np.linalg.norm(end_pose[:3, 3] - goal[:3, 3]))
    turn = float(np.linalg.norm(rotation_vector(end_pose[:3, :3] @ goal[:3, :3].T)))
    turns = any(row.startswith("r") for row in setup.planner.task_rows)
    broken = bool(fast.max() > FAST or far.max() > AHEAD or not np.isfinite(led.q).all())
    accused = [i for i, at in led.named.items() if at < events.doubted[i]]
    found = {}
    for i, at in events.locks:
        if ideal is not None and _would_go(ideal, t, i, at):
            late = led.named.get(i, np.inf) - at
            found[robot.joints[i]] = float(late) if np.isfinite(late) and late >= 0.0 else None
    kept = off <= NEAR and (not turns or turn <= TURNED)
    return {
        "finished": bool(kept and not broken and led.stopped is None),
        "broken": broken,
        "leapt": bool(leap > LEAPS),
        "accused": [robot.joints[i] for i in accused],
        "stopped": led.stopped,
        "locks": found,
        "off": off,
        "turn": turn,
        "fast": float(fast.max()),
        "beyond": float(far.max()),
        "leap": leap,
    }


def _would_go(ideal: FloatArray, t: FloatArray, joint: int, at: float) -> bool:
    """Whether a joint that locks then would have gone far enough to matter."""
    dt = float(t[1] - t[0])
    first = min(round(at / dt), len(ideal) - 1)
    way = ideal[first : first + round(WITHIN / dt), joint]
    return bool(np.abs(way - way[0]).max() > MATTERS)


def ideal_tables(content: Mapping[str, Any]) -> dict[str, Any]:
    """The scenario of an episode in which nothing lags or fails."""
    ideal = copy.deepcopy(dict(content))
    ideal["faults"] = []
    ideal.pop("sensors", None)
    simulation = ideal.get("simulation", {})
    ideal["simulation"] = {key: simulation[key] for key in ("duration", "seed") if key in simulation}
    ideal.setdefault("planner", {})["drive"] = "position"
    return ideal


def beside(made: Callable[[dict[str, Any]], Setup], content: Mapping[str, Any]) -> dict[str, Any]:
    """What everybody makes of an episode, and of what kind it is; ``made`` makes its setup of tables."""
    setup = made(copy.deepcopy(dict(content)))
    events = Events.of(setup)
    ideal = None
    if events.locks:
        log = made(ideal_tables(content)).simulation(log=MEMORY, singularities=False).run().log
        ideal = None if log is None else log["q"]
    led = led_by_ftqp(setup)
    found: dict[str, Any] = {"healthy": events.healthy, "seconds": float(led.t[-1]), "ticks": len(led.t) - 1}
    found["ftqp"] = judged(setup, events, led, ideal)
    found["rival"] = judged(setup, events, led_by_rival(made(copy.deepcopy(dict(content)))), ideal)
    return found


def sentences(seen: Mapping[str, Any], healthy: bool) -> list[str]:
    """What ftqp did that it must not, a sentence each, which begins with a word for its law."""
    lines = []
    if seen["broken"]:
        ways = [f"to {seen['fast']:.3g} times its speed limit"] if seen["fast"] > FAST else []
        ways += [f"{seen['beyond']:.3g} rad or m beyond its range"] if seen["beyond"] > AHEAD else []
        lines.append(
            f"limits are broken: a joint that obeys goes {' and '.join(ways) or 'to no finite place'}"
        )
    if seen["leapt"]:
        lines.append(f"leap after a hold: a joint goes to {seen['leap']:.3g} times what is usual and allowed")
    if seen["accused"]:
        lines.append(f"accused while healthy, as failed or by a brake: {', '.join(seen['accused'])}")
    if healthy and seen["stopped"] is not None:
        lines.append(f"stopped though healthy: {seen['stopped']}")
    return lines


Row = Mapping[str, Any]


def counted(found: Sequence[tuple[Mapping[str, Any], Row]], groups: Sequence[str]) -> list[dict[str, Any]]:
    """The counts of what was drawn and seen, by the values of the groups, and over all."""
    rows = []
    for group in groups:
        names = dict.fromkeys(drawn.get(group) for drawn, _ in found)
        for name in sorted(str(name) for name in names if name is not None):
            own = [seen for drawn, seen in found if str(drawn.get(group)) == name]
            rows.append({"group": group, "name": name, **_counts(own)})
    return [*rows, {"group": "", "name": "all", **_counts([seen for _, seen in found])}]


def _counts(found: Sequence[Row]) -> dict[str, Any]:
    healthy = [seen for seen in found if seen["healthy"]]
    counts: dict[str, Any] = {"episodes": len(found), "healthy": len(healthy)}
    for who in WHO:
        one = [seen[who] for seen in found]
        after = [late for seen in one for late in seen["locks"].values()]
        late = [x for x in after if x is not None]
        counts[who] = {
            "finished": sum(seen["finished"] for seen in one),
            "broken": sum(seen["broken"] for seen in one),
            "leapt": sum(seen["leapt"] for seen in one),
            "accused": sum(bool(seen["accused"]) for seen in one),
            "stopped": sum(seen[who]["stopped"] is not None for seen in healthy),
            "locks": len(after),
            "found": len(late),
            "after": float(np.median(late)) if late else None,
            "off": float(np.median([seen["off"] for seen in one])) if one else None,
            "fast": max((seen["fast"] for seen in one), default=None),
        }
    return counts
