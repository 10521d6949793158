"""Ways of the joints round what is in between: one generator, in slices, for whoever leads an arm."""

from collections.abc import Iterable
from typing import Any, Final, final

import numpy as np

from ftqp.control.inverse_kinematics.posture_search import goal_pose, task_rows
from ftqp.control.references.jerk_limit import TipLimits
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.faults.kinds import FreeSwinging
from ftqp.kernel.entry.way_session import BALL, EFFORT, KEEP, LIMIT, Met, WaySession
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.kernel.layout.thresholds import LEAST_ACCELERATION, RISE_TIME
from ftqp.kernel.layout.ways_room import (
    LEAST_LOOKS,
    LOOKS_A_SECOND,
    MOST,
    PLANNERS_ROWS,
    SHORTENING,
    WayStage,
)

SLACK: Final = 2e-3
"""Between places the tip leaves a tube by this at most [m], or by a tenth of how wide it is where that is
less: a task's usual tolerance."""
TOLERANCE: Final = 1e-6
"""How near a posture has to come to its goal [m]; far below every tolerance of a task."""


def looks_per_tick(dt: float) -> int:
    """Looks at postures between two ticks of so long [s]."""
    return max(LEAST_LOOKS, int(LOOKS_A_SECOND * dt + 0.5))


def refusal(planner: Any, rows: Any = None, *, stays: bool = False) -> str:
    """Why no way of the joints can be looked for; empty where one can.

    Args:
        planner: Whose arm it is, an ``ftqp.Planner``.
        rows: The rows of poses that count; None: those that the planner keeps.
        stays: Whether the tip stays where it is.
    """
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
class Ways(WaySession):
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
        self,
        planner: Any,
        start: FloatArray | None = None,
        *,
        goals: Iterable[FloatArray] = (),
        goal: Any = None,
        rows: Any = None,
        tolerance: tuple[float, float] = (TOLERANCE, TOLERANCE),
        tube: FloatArray | None = None,
        radius: tuple[float, float] = (0.0, 0.0),
        nears: bool = False,
        straight: TipLimits | None = None,
        path: FloatArray | None = None,
        leap: FloatArray | None = None,
        rise_time: float = RISE_TIME,
        most: int = MOST,
        shortening: int = SHORTENING,
        seed: int = 0,
    ) -> None:
        self.ask(
            planner, goal=goal, rows=rows, tolerance=tolerance, tube=tube, radius=radius, nears=nears,
            straight=straight, rise_time=rise_time, most=most, shortening=shortening,
        )  # fmt: skip
        if path is not None and leap is not None:
            self.hold_path(path, leap)
        self._start: FloatArray = planner.view().command.q if start is None else start
        self.begin(self._start, seed)
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
        rise_time: float = RISE_TIME, most: int = MOST, shortening: int = SHORTENING,
    ) -> None:  # fmt: skip
        """Write what is asked, see the class, into memory of zeros; ``places`` are gone to in their order."""
        super().__init__(planner.known)
        self._planner = planner
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
            self.hold_tube(tube, (radius[0], robot.length * radius[1]))
        if straight is not None and goal is not None:
            W.asks_straight, W.asks_rise = 1, max(rise_time, straight.rise_time)
            W.tip_speed[:] = straight.speed, straight.turn
            W.tip_acceleration[:] = straight.acceleration, straight.turn_acceleration
        if places is not None:
            W.asks_places, W.given_place[: len(places), :n] = len(places), places

    def aim(self, goal: Any) -> None:
        """Let the goal be a pose of the tip, and starts for its postures begin anew."""
        super().aim(goal_pose(goal, self._names))

    def add(self, q: FloatArray) -> bool:
        """A further goal posture, any time; whether the arm may stand there."""
        self.add_goal(np.where(self._planner.view().working, q, self._start))
        return self.met is None

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
        met = self.start_met or (None if self.W.has_goal else self.met)
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
