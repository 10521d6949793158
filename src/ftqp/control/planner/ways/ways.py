"""Ways of the joints round what is in between: one generator, in slices, for whoever leads an arm."""

from collections.abc import Iterable
from typing import Any, Final, NamedTuple, final

import numpy as np

from ftqp.control.inverse_kinematics.posture_search import goal_pose, task_rows
from ftqp.control.references.jerk_limit import TipLimits
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.faults.kinds import FreeSwinging
from ftqp.kernel.entry.session import Call, bound, rooms, write_together
from ftqp.kernel.layout.record import memory
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.kernel.layout.scene_room import PAIRS
from ftqp.kernel.layout.thresholds import LEAST_ACCELERATION, RISE_TIME
from ftqp.kernel.layout.ways_room import (
    LEAST_LOOKS,
    LOOKS_A_SECOND,
    MOST,
    PLANNERS_ROWS,
    POSES,
    ROOMS,
    SHORTENING_LOOKS,
    WayStage,
)

SLACK: Final = 2e-3
"""Between places the tip leaves a tube by this at most [m], or by a tenth of how wide it is where that is
less: a task's usual tolerance."""
TOLERANCE: Final = 1e-6
"""How near a posture has to come to its goal [m]; far below every tolerance of a task."""
LIMIT, EFFORT, KEEP, BALL = "limit", "effort", "keep", "ball"
"""What may stand in the way of a posture beside two bodies."""


class Met(NamedTuple):
    """What stands in the way of a posture."""

    kind: str  # LIMIT or EFFORT of a joint, KEEP, BALL of a body, or ``pair``
    number: int  # Of the joint, of what is kept, of the capsule or of the pair of the scene


def looks_per_tick(dt: float) -> int:
    """Looks at postures between two ticks of so long [s]."""
    return max(LEAST_LOOKS, int(LOOKS_A_SECOND * dt + 0.5))


def refusal(planner: Any, rows: Any = None, *, stays: bool = False) -> str:
    """Why no way of the joints can be looked for with these rows; empty where one can."""
    if planner.robot.chain.floating or not planner.robot.is_serial:
        return "arms with branches, and floating ones, go straight only"
    try:
        count = len(task_rows(planner.robot, planner.kept_rows if rows is None else rows)[0])
    except InputError as error:
        return str(error)
    works = int(planner.view().working.sum())
    if stays and works <= count:
        return "no joint is left for a motion on the spot"
    if works == 0:
        return f"no joints work, and the goal has {count} rows"
    swings = any(isinstance(fault, FreeSwinging) for fault in planner.faults.values())
    return "a joint swings freely" if swings else ""


@final
class Ways:
    """Thinks of a way of the joints to any of some goals, and of the motion along it.

    It knows the arm and its scene as a planner believes them when it is made: limits that are left, joints
    that have failed as constants, torque limits, the load. A change calls for another one. Edges are proven
    free, not sampled. The motion is as fast as the limits allow, with limited jerk, and is proven again.

    Args:
        planner: Whose arm it is, an ``ftqp.Planner``.
        start: Where the joints begin, (nv,) [rad or m]; None is where they are commanded.
        goals: Goal postures, (k, nv); more may come by ``add``.
        goal: A pose of the tip, (4, 4), whose postures are looked for meanwhile; None: goals are postures.
        rows: The rows of poses that count, as searches take them; None: those that the planner keeps.
        tolerance: How near a posture comes to a pose in place [m], and in turning [rad], > 0.
        tube: Poses of a path, (k, 4, 4), that the tip stays near; None: it goes anywhere.
        radius: By how much, in place [m] and in turning [rad].
        nears: Whether the nearest posture that was found will do where the goal has no clear one.
        straight: Limits of the tip, ``ftqp.TipLimits``, with which it goes straight to the goal where the
            joints can follow that; None: the way is that of the joints.
        path: Poses of a path, (k, 4, 4), that postures are followed along.
        leap: How far joints go from one of them to the next at most, (nv,) [rad or m].
        rise_time: How long accelerations take to reach their limits, > 0 [s].
        most: So many looks are spent on trees at most.
        shortening: So many are spent on making the way shorter.
        seed: Of what is drawn: the same looks give the same way.

    Source: docs/theory/round-obstacles.md.
    """

    def __init__(
        self, planner: Any, start: FloatArray | None = None, *, goals: Iterable[FloatArray] = (),
        path: FloatArray | None = None, leap: FloatArray | None = None, seed: int = 0, **asked: Any,
    ) -> None:  # fmt: skip
        self.ask(planner, **asked)
        if path is not None and leap is not None:
            self.W.path, self.W.path_pose[: len(path)] = len(path), path[:, :3].reshape(-1, 12)
            self.W.leap[: self.n] = leap
        self._start: FloatArray = planner.view().command.q if start is None else start
        write_together(self.rooms)
        self._bind("begin_asked", self._session.memory, np.ascontiguousarray(self._start))(seed)
        for q in goals:
            self.add(q)

    @classmethod
    def asked(cls, planner: Any, **asked: Any) -> "Ways":
        """A search that somebody else begins, of what is asked as of a search."""
        ways = cls.__new__(cls)
        ways.ask(planner, **asked)
        return ways

    def ask(
        self, planner: Any, *, goal: Any = None, rows: Any = None, places: FloatArray | None = None,
        tolerance: tuple[float, float] = (TOLERANCE, TOLERANCE), tube: FloatArray | None = None,
        radius: tuple[float, float] = (0.0, 0.0), nears: bool = False, straight: TipLimits | None = None,
        rise_time: float = RISE_TIME, most: int = MOST, shortening: int = SHORTENING_LOOKS,
    ) -> None:  # fmt: skip
        """Write what is asked, see the class, into memory of zeros; ``places`` are gone to in their order."""
        self._planner, self._session = planner, planner.known
        self.memory, self.n = memory("ways"), planner.robot.nv
        self.K: Any = rooms(self.memory)
        self.W: Any = self.K.ways
        W, robot, n = self.W, planner.robot, planner.robot.nv
        a_max, j_max = robot.limits.a_max, robot.limits.j_max
        W.a_least[:n], W.jerk[:n] = LEAST_ACCELERATION * a_max, np.minimum(a_max / rise_time, j_max)
        W.length, W.asks_rise = robot.length, rise_time
        W.tolerance[:] = tolerance[0], robot.length * tolerance[1]
        W.asks_most, W.shortening, W.asks_nears = most, shortening, nears
        tool, self._names = False, tuple[str, ...]()
        W.asks_rows = PLANNERS_ROWS
        if goal is not None or tube is not None or rows is not None:
            self._names, tool = task_rows(robot, planner.kept_rows if rows is None else rows)
        if rows is not None:
            W.asks_rows, W.asks_axis = sum(1 << COMPONENTS.index(name) for name in self._names), tool
        if goal is not None:
            W.asks_pose, W.given_goal[:] = 1, goal_pose(goal, self._names).ravel()
        if tube is not None:
            W.slack = min(SLACK, 0.1 * radius[0]) if radius[0] > 0.0 else SLACK
            every = tube[np.linspace(0, len(tube) - 1, min(len(tube), POSES)).astype(int)]
            W.tube, W.given_tube[: len(every)] = len(every), every[:, :3].reshape(-1, 12)
            W.radius[:] = radius[0], robot.length * radius[1]
        if straight is not None and goal is not None:
            W.asks_straight, W.asks_rise = 1, max(rise_time, straight.rise_time)
            W.tip_speed[:] = straight.speed, straight.turn
            W.tip_acceleration[:] = straight.acceleration, straight.turn_acceleration
        if places is not None:
            W.asks_places, W.given_place[: len(places), :n] = len(places), places

    @property
    def rooms(self) -> list[tuple[Any, Any]]:
        """What is copied, and from where, before it begins."""
        return [(self.memory[room], self._session.memory[room]) for room in ROOMS]

    def aim(self, goal: Any) -> None:
        """Let the goal be a pose of the tip, and starts for its postures begin anew."""
        self._bind("aim_at", np.ascontiguousarray(goal_pose(goal, self._names)))()

    def add(self, q: FloatArray) -> bool:
        """A further goal posture, any time; whether the arm may stand there."""
        goal = np.where(self._planner.view().working, q, self._start)
        self._bind("add_goal", np.ascontiguousarray(goal))()
        return self.met is None

    @property
    def met(self) -> Met | None:
        """What stands in the way of the goal posture that was added last, or before any of the start."""
        return self._said(int(self.W.goal_met))

    @property
    def has_way(self) -> bool:
        """Whether there is a way, which may still become shorter."""
        return self.stage not in (WayStage.FOLLOWING, WayStage.GROWING, WayStage.NO_WAY)

    @property
    def goes_straight(self) -> bool:
        """Whether the tip goes straight to a pose, or all joints to a posture, as far as is known."""
        W = self.W
        return bool(W.straight) or (not W.has_goal and self.has_way and int(W.places) == 2)

    @property
    def only_nears(self) -> bool:
        """Whether the way leads to the nearest posture, as the goal has no clear one."""
        return int(self.W.nears) > 1

    @property
    def way(self) -> FloatArray:
        """The places of the way, the start first, (k, nv) [rad or m]."""
        return np.array(self.W.place[: int(self.W.places), : self.n])

    @property
    def is_free(self) -> bool:
        """Whether the motion is proven free; READY only."""
        return bool(self.W.is_free)

    @property
    def looks(self) -> int:
        """Postures that were looked at so far."""
        return int(self.W.looks)

    @property
    def starts(self) -> int:
        """Newton starts for postures of the goal so far."""
        return int(self.W.starts)

    @property
    def sentence(self) -> str:
        """What was looked for, where there is no way."""
        posed, clear = int(self.W.posed), int(self.W.clear)  # postures of the goal, and those that are clear
        met = self._said(int(self.W.start_met)) or (None if self.W.has_goal else self.met)
        if met is not None:
            return str(self.sentence_of(met))
        if not self.W.has_goal or clear:
            return f"no way round was found in {self.looks} looks"
        if not posed:
            return f"no posture was found in {self.starts} starts"
        most = self.sentence_of(self.hindrance)
        return f"none of {posed} postures found in {self.starts} starts is clear: most often {most}"

    def sentence_of(self, met: Met | None) -> str | None:
        """What stands in the way of a posture, in words."""
        robot = self._planner.robot
        if met is None:
            return None
        if met.kind == LIMIT:
            return f"{robot.joints[met.number]} is out of its range"
        if met.kind == EFFORT:
            return f"{robot.joints[met.number]} is too weak to hold the arm"
        if met.kind == KEEP:
            return "it is not on the side where it is kept"
        keep = 1e3 * float(self.W.keep)
        if met.kind == BALL:
            return f"a body is nearer than {keep:.3g} mm to the cloud"
        one, other = self._planner.watched_pairs[met.number]
        return f"{one} is nearer than {keep:.3g} mm to {other}"

    @property
    def hindrance(self) -> Met | None:
        """What stood in the way of postures of the goal most often, where none is clear."""
        return self._said(int(self.W.hindered.argmax()))

    @property
    def stage(self) -> WayStage:
        """How far it is."""
        return WayStage(int(self.W.stage))

    @property
    def is_searching(self) -> bool:
        """Whether there is more to think of."""
        return self.stage not in (WayStage.READY, WayStage.NO_WAY)

    def find(self, looks: int) -> FloatArray | None:
        """A further clear posture of the goal, (nv,), within about so many looks; None: not found yet."""
        return self.W.drawn[: self.n].copy() if self._bind("find_posture")(looks) else None

    def explore(self, looks: int) -> int | None:
        """A further place that can be come to, by number, within about so many looks; None: not yet."""
        node = int(self._bind("explore")(looks))
        return None if node < 0 else node

    def place(self, node: int) -> FloatArray:
        """A place that was explored, (nv,) [rad or m]."""
        return np.array(self.W.node[0, node * self.n : (node + 1) * self.n])

    def lead_to(self, node: int) -> None:
        """Let there be a way to a place that was explored."""
        self._bind("lead_to")(node)

    def begin_following(self, q: FloatArray, first: int) -> None:
        """Let the path be followed from a posture at one of its poses."""
        self.W.followed, self.W.follows[: len(q)] = first, q

    def follow(self, looks: int) -> bool:
        """Follow it on for about so many looks; whether it ends, as joints cannot go on or at its end."""
        return bool(self._bind("follow_path")(looks))

    @property
    def at(self) -> FloatArray:
        """Where the joints are there, (nv,) [rad or m]."""
        return np.array(self.W.follows[: self.n])

    @property
    def followed(self) -> int:
        """The pose of the path that was come to."""
        return int(self.W.followed)

    def search_step(self, looks: int) -> WayStage:
        """One slice of about so many looks at postures; what is done then."""
        if self.is_searching:
            self._bind("search_step")(looks)
        return self.stage

    @property
    def duration(self) -> float:
        """How long the motion takes [s]; READY only."""
        return float((self.W.ticks - 1) * self.W.period)

    @property
    def motion(self) -> FloatArray:
        """The places after every period from rest to rest, (ticks, nv) [rad or m]; READY only."""
        ticks, n = int(self.W.ticks), self.n
        return np.array(self.W.table[: ticks * n]).reshape(ticks, n)

    def _bind(self, name: str, *things: Any) -> Call:
        return bound(name, self.memory, *things)

    @staticmethod
    def _said(code: int) -> Met | None:
        """What the kernel's number stands for, see ``ftqp.kernel.search.looks``."""
        if code == 0:
            return None
        kinds = ("pair", LIMIT, EFFORT, KEEP, BALL)
        return Met(kinds[(code - 1) // PAIRS], (code - 1) % PAIRS)
