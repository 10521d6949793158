"""A planner led by a motion of the joints to a posture, straight or round what is in between."""

from typing import Any, final

import numpy as np

from ftqp.control.planner.planner_view import PlannerView
from ftqp.control.planner.step import Step
from ftqp.control.planner.ways.ways import Ways
from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.session import ArmSession, Call, Memory, bound, copies
from ftqp.kernel.layout.enums import Going
from ftqp.kernel.layout.thresholds import (
    ACCELERATION_SHARE,
    BANDWIDTH,
    BANDWIDTH_STEPS,
    LEAST_ACCELERATION,
    RISE_TIME,
)
from ftqp.kernel.layout.ways_room import AS_ASKED, NO_REST, ROUND, STRAIGHT


def motion_of_joints(planner: Any) -> Memory:
    """Memory of a motion of the joints that a planner follows, with the gains on the error to it."""
    memory = Memory("joints")
    bandwidth = min(BANDWIDTH, BANDWIDTH_STEPS / planner.dt)
    accelerates = planner.level == "acceleration"
    memory.fields.kp = bandwidth**2 if accelerates else bandwidth
    memory.fields.kv = 2.0 * bandwidth if accelerates else 0.0
    return memory


@final
class JointTracker:
    """The planner's steps along a jerk-limited motion of the joints, see ``ftqp.kernel.search.on_the_way``.

    It is planned from the last command, anew at the very tick at which the belief in a joint or a limit
    changes, so that position and velocity go on without a jump. Where a way is sought, the arm comes to rest,
    the way is looked for, a little in every tick, straight first, and its motion is played.

    Args:
        planner: The planner that it leads.
        goal: The posture to go to, straight until another one is asked for, (nv,) [rad or m].
        rise_time: How long accelerations take to reach their limits, > 0 [s].
        meant: Where the end effector is meant to be meanwhile, (4, 4), or None.
        whole: Whether the whole task is asked for where the motion begins.
        tolerance: How near every joint has to be to the goal, > 0 [rad or m].

    Attributes:
        state: Where the arm stands on its way, as it was measured for the last step.
    """

    def __init__(
        self, planner: Any, goal: FloatArray, rise_time: float = RISE_TIME, meant: FloatArray | None = None,
        *, whole: bool = True, tolerance: float = 1e-3,
    ) -> None:  # fmt: skip
        self.planner, self._rise_time = planner, rise_time
        self.view: PlannerView = planner.view()
        self._session, robot, n = planner.known, planner.robot, planner.robot.nv
        self._going, self._joints = Memory("going"), motion_of_joints(planner)
        self._arm = ArmSession(robot.chain.constants())
        self.W: Any = self._going.fields
        a_max = robot.limits.a_max
        self.W.least[:n] = LEAST_ACCELERATION * a_max
        self.W.jerk[:n] = ACCELERATION_SHARE * np.minimum(a_max / rise_time, robot.limits.j_max)
        self.W.counts[:n], self.W.whole, self.W.tolerance = 1, whole, tolerance
        self._lead: Any = planner.lead(self._joints, meant)
        self._begins = self._session.bind("begins_anew", self._going.memory)
        self._aims = self._session.bind("aim_going", self._going.memory)
        self.state = Going.MOVING
        self._take(None)
        self.aim(goal)

    def _take(self, ways: Ways | None) -> None:
        """Let a search be that of the motion, none of a straight one."""
        self.ways = ways
        session, going, memory = self._session, self._going.memory, None if ways is None else ways.memory
        adopted = (self._arm.memory["chain"], session.memory["chain"])
        self._copies = copies([adopted, *([] if ways is None else ways.rooms)])
        self._before = session.bind(
            "lead_going", self._arm.memory, going, self._joints.memory, memory, self._copies,
            len(self._copies),
        )  # fmt: skip
        self._after = session.bind("follow_going", going, memory)
        self._on_way: Call = bound("is_on_way", going, memory)

    def _go(self, goal: FloatArray, asks: int) -> None:
        self.W.goal[: len(goal)] = goal
        self._aims(asks)

    def aim(self, goal: FloatArray) -> None:
        """Go straight to another posture from the next step on."""
        self._go(goal, STRAIGHT)

    def seek(self, q: FloatArray | None, **asked: Any) -> None:
        """Go to another posture from the next step on, round what is in between.

        What else is ``asked`` of ``Ways`` may be a tube, a pose whose postures are the goals, or places to
        go to before it, one after the other.
        """
        self._take(Ways.asked(self.planner, rise_time=self._rise_time, **(asked or {"nears": True})))
        self._go(self.view.command.q if q is None else q, AS_ASKED if asked else ROUND)

    def begin(self) -> None:
        """Let the next step begin at the arm."""
        self.W.ticks = -1

    def begins_anew(self) -> bool:
        """Whether something else is believed than a tick ago, or somebody else has led the planner."""
        return bool(self._begins())

    def goes_on(self) -> None:
        """The tick was that of the same motion, led otherwise."""
        self.W.ticks = self.view.ticks

    @property
    def counts(self) -> Any:
        """Which joints have to be at the goal when it is reached, (nv,), to be written."""
        return self.W.counts[: self.planner.robot.nv]

    @property
    def _is_searched(self) -> bool:
        return self.ways is not None and bool(self.W.plays or self.W.thinks or self.W.blocked)

    @property
    def searched(self) -> Ways | None:
        """What has looked for the present way."""
        return self.ways if self._is_searched else None

    @property
    def blocked(self) -> str | None:
        """Why there is no way to the goal itself; None while that is not known."""
        if self.ways is None or not (self.W.blocked or self.only_nears):
            return None
        return "the arm does not come to rest" if self.W.blocked == NO_REST else self.ways.sentence

    @property
    def too_heavy(self) -> str | None:
        """The joint whose motor cannot hold the arm farther on the way; None where all can."""
        return None if self.W.heavy < 0 else str(self.planner.robot.joints[int(self.W.heavy)])

    @property
    def is_searching(self) -> bool:
        """Whether a way is being looked for, and the arm stands meanwhile."""
        return not self.W.plays and self.is_on_way

    @property
    def is_on_way(self) -> bool:
        """Whether a way is being looked for, or its motion is played and not over."""
        return bool(self._on_way())

    @property
    def goes_straight(self) -> bool:
        """Whether the tip goes straight, as far as is known."""
        ways = self.ways
        return ways is not None and (ways.goes_straight if self._is_searched else bool(ways.W.asks_straight))

    @property
    def only_nears(self) -> bool:
        """Whether the joints go to the nearest posture of a goal that has no clear one."""
        return self.ways is not None and self._is_searched and self.ways.only_nears

    @property
    def way(self) -> FloatArray:
        """What is left of the way of every joint as commanded, (nv,) [rad or m]; the short way round."""
        return self.way_from(self.view.command.q)

    def way_from(self, q: FloatArray) -> FloatArray:
        """From joint positions to the goal, (nv,) [rad or m]; for a continuous joint the short way round."""
        way: FloatArray = np.array(self.W.goal[: len(q)]) - q
        return np.where(self.planner.robot.continuous, np.remainder(way + np.pi, 2.0 * np.pi) - np.pi, way)

    def step(self, q: Any, v: Any, tau: Any = None, tip: Any = None) -> Step:
        """A step on the way; see ``Planner.step``."""
        if self.view.is_reset:
            self._before()
        step: Step = self._lead.step(q, v, (), tau, tip)
        self.state = Going(self._after(step.code))
        return step
