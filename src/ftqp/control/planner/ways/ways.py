"""Ways of the joints round what is in between: one generator, in slices, for whoever leads an arm."""

from collections.abc import Iterable
from typing import Any, Final, final

import numpy as np

from ftqp.control.inverse_kinematics.motion_validity import HELD
from ftqp.control.inverse_kinematics.posture_search import goal_pose, task_rows
from ftqp.control.references.jerk_limit import TipLimits
from ftqp.control.task.task import axis_frame
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_exp, rotation_vector, transform
from ftqp.faults.kinds import FreeSwinging
from ftqp.kernel.entry.way_session import BALL, EFFORT, KEEP, LIMIT, Met, WaySession
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.kernel.layout.thresholds import LEAST_ACCELERATION, RISE_TIME
from ftqp.kernel.layout.ways_room import WayStage

SLACK: Final = 2e-3
"""Between places the tip leaves a tube by this at most [m], or by a tenth of how wide it is where that is
less: a task's usual tolerance."""
MOST: Final = 400_000
"""So many looks are spent on trees at most, about a second. A guess."""
SHORTENING: Final = 1500
"""So many looks are spent on making a way shorter. A guess: 3,000 shorten ways from 8.1 to 4.9 rad and take
ten times the search."""
TOLERANCE: Final = 1e-6
"""How near a posture has to come to its goal [m]; far below every tolerance of a task."""
LINE, LEAP = 60, 0.3
"""The straight way of the tip is followed in so many places, and from one to the next joints go this far at
most [rad or m]. Guesses."""


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
        places: Places to go to one after the other, (k, nv), as the way; None: it is looked for.
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
        effort: The share of a torque limit that may hold the arm at rest.
        most: So many looks are spent on trees at most.
        shortening: So many are spent on making the way shorter.
        seed: Of what is drawn: the same looks give the same way.

    Attributes:
        met: What stands in the way of the start, or of the goal posture that was added last.
        start_blocked: What stands in the way of the start, in words; None where nothing does.

    Source: docs/theory/round-obstacles.md.
    """

    def __init__(
        self,
        planner: Any,
        start: FloatArray | None = None,
        *,
        goals: Iterable[FloatArray] = (),
        places: FloatArray | None = None,
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
        effort: float = HELD,
        most: int = MOST,
        shortening: int = SHORTENING,
        seed: int = 0,
    ) -> None:
        super().__init__(*planner.way_session())
        self._planner = planner
        W, robot, n = self.W, planner.robot, planner.robot.nv
        self._start: FloatArray = planner.view().command.q if start is None else start
        W.effort, W.length, W.most = effort, robot.length, most
        W.tolerance[:] = tolerance[0], robot.length * tolerance[1]
        W.shortening, W.nears = shortening, nears
        W.dt, W.speed = planner.dt, planner.pace
        W.a_max[:n] = np.maximum(W.a_max[:n], LEAST_ACCELERATION * robot.limits.a_max)
        W.rise = max(rise_time, float((W.a_max[:n] / robot.limits.j_max)[W.free[:n] > 0].max(initial=0.0)))
        self.draw_about(self._start, seed)
        self._tool = np.eye(4)
        if goal is not None or tube is not None or path is not None:
            self._choose_rows(planner.kept_rows if rows is None else rows)
        if goal is not None:
            self.aim(goal)
        if tube is not None:
            W.slack = min(SLACK, 0.1 * radius[0]) if radius[0] > 0.0 else SLACK
            self.hold_tube(tube @ self._tool, (radius[0], robot.length * radius[1]))
        if straight is not None and goal is not None:
            path, leap = self._line_to(goal), np.full(n, LEAP)
            W.straight, W.rise = 1, max(float(W.rise), straight.rise_time)
            W.tip_speed[:] = straight.speed, straight.turn
            W.tip_acceleration[:] = straight.acceleration, straight.turn_acceleration
        if path is not None and leap is not None:
            self.hold_path(path @ self._tool, leap)
        self.met: Met | None = self.begin(self._start)
        self.start_blocked = self.sentence_of(self.met)
        if places is not None:
            self.go_along(places)
        for q in goals:
            self.add(q)

    def _line_to(self, goal: FloatArray) -> FloatArray:
        """Poses of the tip straight from the start to a pose, (k, 4, 4)."""
        now, share = self._planner.view().poses(self._start[None])[0], np.linspace(0.0, 1.0, LINE + 1)
        turn = rotation_vector(goal[:3, :3] @ now[:3, :3].T)
        line = np.tile(now, (LINE + 1, 1, 1))
        line[:, :3, 3] += share[:, None] * (goal[:3, 3] - now[:3, 3])
        line[:, :3, :3] = [rotation_exp(k * turn) @ now[:3, :3] for k in share]
        return line

    def _choose_rows(self, rows: Any) -> None:
        """Let these rows of poses count."""
        self._names, tool = task_rows(self._planner.robot, rows)
        self.choose_rows(sum(1 << COMPONENTS.index(name) for name in self._names), tool)
        if tool:
            self._tool = transform(axis_frame(self._planner.task.axis), np.zeros(3))

    def aim(self, goal: Any) -> None:
        """Let the goal be a pose of the tip, and starts for its postures begin anew."""
        super().aim(goal_pose(goal, self._names))

    def add(self, q: FloatArray) -> bool:
        """A further goal posture, any time; whether the arm may stand there."""
        self.met = self.add_goal(np.where(self._planner.view().working, q, self._start))
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
        if self.start_blocked is not None or (not self.W.has_goal and self.met is not None):
            return str(self.start_blocked or self.sentence_of(self.met))
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
