"""Following a path by its progress: the path waits for the arm, and a stalled arm is led out of its trap."""

import logging
from collections.abc import Generator
from enum import Enum
from math import inf
from typing import Any, final

import numpy as np

from ftqp.control.following.blockage import Blockage
from ftqp.control.following.path_intervals import path_table
from ftqp.control.following.reconfiguration import KEPT, Reconfiguration, fewer_rows_hold
from ftqp.control.following.stall import StallEscape
from ftqp.control.paths.path import Path
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.start import path_in_millimetres
from ftqp.control.planner.step import Step
from ftqp.control.planner.target import Target, target_on
from ftqp.core.checks import instance, seen
from ftqp.core.errors import InputError
from ftqp.core.fixed import Fixed
from ftqp.kernel.entry.session import Memory
from ftqp.kernel.layout.enums import HELD, OK, RELAXED, SCALED
from ftqp.kernel.layout.thresholds import SCALED_FROM

_LOG = logging.getLogger("ftqp")
STANDS = 0.01
"""A mean rate below this is none: the path stands."""
LIMITED = 0.5
"""A rate that the path's next jump holds below this is no stall, unless it is below this share of that."""
FOUND, ON_THE_SPOT, PASSING = -1, -2, -3
"""Stand for a pattern where the kernel has found a way past a singularity, where a search has, and where the
tip goes on as near to its path as it can."""
ON_TASK = (OK, RELAXED, SCALED)
"""Codes of steps that attempt the task: a stop is no stall."""


STANDS_FOR, DRAGS_FOR = 0.2, 0.5
"""A motion on the spot is looked for where the path has stood for the first share of the time after which it
is called blocked, or has been stalled for the second one."""
HELPS_WITHIN = 0.3
"""A path from which rows were given up and that is stalled for so long gives up the next ones, or is blocked
[s]."""
MOST_BRIDGES = 5
"""So many bridges are gone on one path before the tip waits, ..."""
MOST_SPOTS = 12
"""... and so many motions on the spot."""


class PathStatus(Enum):
    """Where a path stands; its value is the sentence for the operator."""

    FOLLOWING = "the path is followed at its own speed"
    SCALED = "the path is followed more slowly, because its full speed would break a limit"
    ESCAPING = "the path has stalled; the joints are moving on the spot to find a way on"
    BLOCKED = "the path is blocked; the end effector waits on it until resume() or reset()"
    DONE = "the path is finished"
    PASSING = "the path cannot be kept; the end effector goes on as near to it as it can"
    BRIDGING = "the path is blocked; another posture from which it goes on is looked for, or gone to"
    FEWER_ROWS = "the path is followed in fewer rows of its task, as all of them cannot be held"


def _leave(bridges: bool, leave: float | None) -> float:
    """How far the tip may leave its path [m]; inf is anywhere."""
    if leave is None:
        return inf if bridges else 0.0
    if isinstance(leave, bool) or not isinstance(leave, int | float | np.number) or not 0.0 <= leave <= inf:
        raise InputError(
            f"leave is {leave!r:.60}, expected a length from 0 [m], how far the end effector may go"
        )
    if bridges and leave == 0.0:
        raise InputError(
            "bridges is True and leave 0, so that the end effector could not go; give a length > 0 or None"
        )
    return float(leave)


@final
class PathFollower:
    """Leads a planner along a path whose time, the progress, runs only as fast as the arm can follow.

    The path rate s in [0, 1] is one more variable of the planner's QP: J v - s x'(progress) = kp e, where e
    is the error to the path at the progress reached, so that it never winds up. Priorities are, in this
    order: limits, staying on the path, progress, the scheme. At the acceleration level the rate is a state
    with the decision progress'' of its own.

    Args:
        planner: The planner that it commands, made with ``Task(mode="scaled")``.
        path: What the end effector is to follow, in its own time; a rate of 1 is the path's own speed.
        stall: When to break the symmetry of a posture that has stalled the path, and when to call the path
            blocked. None does neither: a path that cannot go on then waits without a verdict.
        bridges: Whether a blocked path may be bridged: the end effector then leaves it, the joints go to
            another posture of the place where it was left, from which it goes on, and it does. Without, the
            end effector waits on the path. For processes that must not be left, such as welding, leave it
            off.
        leave: How far the end effector may leave the path meanwhile, from 0 [m]: it stays within so much of
            its path, and its rotation within so much over the characteristic length. With a length it first
            goes on as near to the path as it can, within 0.8 of the emergency stop's thresholds, and comes
            back to it; a bridge is looked for where that is not enough. None is anywhere with bridges and 0,
            not at all, without. The less it may, the fewer blocked paths go on.

    Raises:
        InputError: The planner has another task mode, the path is too rough, or ``leave`` is no length, or
            is 0 with bridges.

    Source: Bedrossian 1993, extended in ``docs/theory/path-progress.md``.
    """

    __slots__ = (
        "_blockage", "_bridge", "_bridges", "_duration", "_fewer", "_has_asked", "_lead",
        "_leave", "_mean", "_memory", "_path", "_pattern", "_planner", "_rate", "_share", "_spot",
        "_spots", "_stall", "_stalled", "_standing", "_state", "_stood", "_stood_at", "_target",
    )  # fmt: skip

    planner: Fixed[Planner] = Fixed("_planner")
    path: Fixed[Path] = Fixed("_path")
    stall: Fixed[StallEscape | None] = Fixed("_stall")
    _pattern: int | None
    _blockage: Blockage | None
    _bridge: Reconfiguration | None
    _spot: Reconfiguration | None
    _fewer: Generator[None, None, int] | None
    _has_asked: bool

    def __init__(
        self,
        planner: Planner,
        path: Path,
        *,
        stall: StallEscape | None = StallEscape(),  # noqa: B008  frozen
        bridges: bool = False,
        leave: float | None = None,
    ) -> None:
        instance("bridges", bridges, bool, "True or False")
        instance("planner", planner, Planner, "an ftqp.Planner, ftqp.Planner(robot, task=...)")
        instance("path", path, Path, "a path of ftqp.paths, for example ftqp.paths.Circle(pose, 0.1)")
        if stall is not None and not isinstance(stall, StallEscape):
            raise InputError(f"stall is {stall!r:.60}, expected an ftqp.StallEscape or None")
        if said := path_in_millimetres(planner.robot, path):
            _LOG.warning("%s: %s", planner.robot.name, said)
        self._planner, self._path, self._stall = planner, path, stall
        self._leave = _leave(bridges, leave)
        memory = Memory("path", path_table(path))
        self._memory, self._lead = memory, planner.lead(memory)
        self._state = memory.fields
        memory.fields.target[:] = Target(pose=path.start).packed
        self._target = target_on(seen(memory.fields.target))
        self._rate = memory.memory["rate"]
        self._duration = path.duration
        self._standing = stall.standing if stall is not None and planner.task.calm else inf
        self._share = 0.0 if stall is None else min(1.0, planner.dt / stall.after)
        self.begin()

    def resume(self) -> None:
        """Go on after a blockage, for example because a joint has been repaired."""
        self._mean, self._stalled = 1.0, 0.0
        self._stood, self._stood_at = 0.0, 0.0
        self._state.limit = 1.0
        self._rest()

    def reset(self, q: Any, v: Any = None) -> None:
        """Begin the path anew at (q, v), see ``Planner.reset``.

        Args:
            q: The measured configuration, (nv,) joint values or (nq,) [rad or m].
            v: The measured velocity, (nv,) [rad/s or m/s]; None is rest.
        """
        self._planner.reset(q, v)
        self.begin()

    def begin(self) -> None:
        """Begin the path anew and leave the planner as it is."""
        self._memory.call("begin_path")
        self._bridges, self._spots = MOST_BRIDGES if self._leave > 0.0 else 0, MOST_SPOTS
        self.resume()

    def step(self, q: Any, v: Any = None, *, tau: Any = None, tip: Any = None) -> Step:
        """The command for the next ``dt``, and the path's progress with it; see ``Planner.step``.

        Args:
            q: The measured configuration, (nv,) joint values or (nq,) [rad or m].
            v: The measured velocity, (nv,) [rad/s or m/s], or None: the planner observes it from q.
            tau: The measured torque, (nv,) [N m or N], or None.
            tip: The measured pose of the end effector, (4, 4), or None to take that of the model.
        """
        if self._bridge is not None:
            return self._bridged(self._bridge, q, v, tau, tip)
        spot = self._spot
        if spot is not None and spot.way is not None:
            self._go_on_the_spot(spot)
        self._planner.foresee(self._path, self.progress)
        step = self._lead.step(q, v, (), tau, tip)
        if self._stall is not None and self._pattern != ON_THE_SPOT and step.code != HELD:
            self._mean += self._share * (self._rate[0] - self._mean)
            if self._mean < self._stall.below or self._stalled > 0.0:
                self._watch(self._stall, step)
        return step

    @property
    def memory(self) -> Memory:
        """The path as compiled code has it, for ``ftqp build``."""
        return self._memory

    @property
    def target(self) -> Target:
        """Pose, twist and acceleration of the path, in its own time, that the last step aimed at."""
        return self._target

    @property
    def progress(self) -> float:
        """The path time that has been reached [s]; it never runs backwards."""
        return float(self._state.progress)

    @property
    def rate(self) -> float:
        """How fast the progress runs, 1 at the path's own speed."""
        return max(float(self._rate[0]), 0.0)

    @property
    def status(self) -> PathStatus:
        """Where the path stands."""
        if self._state.progress >= self._duration and self._blockage is None:
            return PathStatus.DONE
        if self._bridge is not None and not self._bridge.is_over:
            return PathStatus.BRIDGING
        if self._blockage is not None:
            return PathStatus.BLOCKED
        if self._pattern is not None:
            return PathStatus.PASSING if self._pattern == PASSING else PathStatus.ESCAPING
        if self._lead.given_up:
            return PathStatus.FEWER_ROWS
        return PathStatus.SCALED if 0.0 <= self._rate[0] < SCALED_FROM else PathStatus.FOLLOWING

    @property
    def blocked(self) -> str | None:
        """Which way the end effector cannot go on and what holds it; None while the path is not blocked."""
        if self._blockage is None:
            return None
        text = self._blockage.sentence
        return text if self._bridge is None else f"{text}; {self._bridge.sentence}"

    def _bridged(self, bridge: Reconfiguration, q: Any, v: Any, tau: Any, tip: Any) -> Step:
        """A step while the path is blocked: the tip waits on it, or the joints go over a bridge."""
        if bridge.leads:
            step = bridge.step(q, v, tau, tip)
            if bridge.done:
                self._bridges -= 1
                self._state.progress = max(self.progress, bridge.until)
                self.resume()
            return step
        step = self._lead.step(q, v, (), tau, tip)
        if step.code in ON_TASK:
            bridge.search_step()
            if bridge.is_over:
                self._go_on_with_fewer_rows()
                self._goes_on_unasked()
        return step

    def _watch(self, stall: StallEscape, step: Step) -> None:
        """The mean rate is low, or was: begin, change or end an escape."""
        state = self._state
        if self._blockage is not None or step.code not in ON_TASK:
            return
        if state.ahead < LIMITED and self._rate[0] > LIMITED * state.ahead:
            return
        ended = state.progress >= self._duration
        off = self._pattern == PASSING and self._is_off(step, ended)
        if (self._mean > stall.until or ended) and not off:
            self._stalled = self._stood = 0.0
            self._rest()
            return
        self._stood += self._planner.dt
        if state.found or state.progress > self._stood_at + STANDS * self._standing:
            self._stood, self._stood_at = 0.0, state.progress
        if self._pattern == PASSING:
            if self._stood > self._standing or ended:
                self._block(step)
        elif self._mean < stall.below and self._lead.given_up:
            self._stalled += self._planner.dt  # fewer rows help at once, or the next set goes
            if self._stalled > HELPS_WITHIN:
                self._block(step)
        elif self._mean < stall.below:
            tried = max(self._stalled / stall.patience, self._stood / self._standing)
            stands = self._stood > STANDS_FOR * self._standing
            if (stands or self._stalled > DRAGS_FOR * stall.patience) and self._looks_on_the_spot():
                return
            self._stalled += self._planner.dt
            state.speed = stall.speed
            if tried >= 1.0 and (self._spots <= 0 or (self._spot is not None and self._spot.is_over)):
                if self._passes():
                    return
                if self._bridges > 0 or not self._goes_on_unasked():
                    self._block(step)
            elif state.found:
                self._pattern = FOUND
            else:
                self._try(stall, int(min(tried, 0.999) * len(stall.patterns)))

    def _passes(self) -> bool:
        """Go on as near to the path as the tip can, where it may leave it by a length; whether it does."""
        if self._bridges <= 0 or np.isinf(self._leave):
            return False
        self._bridges -= 1
        self._rest()
        self._pattern, self._stood = PASSING, 0.0
        self._state.aside = KEPT * self._leave
        return True

    def _is_off(self, step: Step, ended: bool) -> bool:
        """Whether the tip is beyond the task's tolerances, or before the path's end goes there or waits."""
        task = self._planner.task
        off = step.position_error > task.tolerance or step.rotation_error > task.rotation_tolerance
        return off or (not ended and (step.code == RELAXED or self._state.left < 1.0))

    def _looks_on_the_spot(self) -> bool:
        """Think of a motion on the spot, a piece of it; whether one is there, which is gone from now on."""
        if self._spots <= 0:
            return False
        if self._spot is None or not self._spot.is_of_now:
            self._spot = Reconfiguration(self._planner, self._path, self.progress, 0.0)
        self._spot.search_step()
        if self._spot.way is None:
            return False
        self._pattern, self._state.limit = ON_THE_SPOT, 0.0
        self._state.speed, self._state.driven = 0.0, 1
        return True

    def _go_on_the_spot(self, spot: Reconfiguration) -> None:
        """Draw the null space along a way on the spot; the path goes on behind its end."""
        drive = spot.drive(self._planner.dt)
        if drive is None:
            self._spots -= 1
            self.resume()
            return
        self._state.drive[: len(drive)] = drive

    def _block(self, step: Step) -> None:
        """Nothing has helped: the path waits from now on."""
        searched = "" if self._spot is None else self._spot.sentence
        self._rest()
        self._state.limit = 0.0
        self._blockage = Blockage(
            self._planner, self._lead, self._target, self.progress, self._duration, step, searched
        )
        if self._bridges > 0:
            self._bridge = Reconfiguration(self._planner, self._path, self.progress, self._leave)
        else:
            self._go_on_with_fewer_rows()

    def _go_on_with_fewer_rows(self) -> None:
        """Give up the next rows of the task, where some may be, and let the path go on without them."""
        planner = self._planner
        if planner.task.degrade is not None and self._lead.give_up():
            self.resume()

    def _goes_on_unasked(self) -> bool:
        """Think of fewer rows of a failed arm, a piece of it; whether it is thought of, or they are given up.

        Nobody has named the sets that may be kept, so that rows are given up only where a search says that
        the path goes on with the others, and not with all of them.
        """
        planner = self._planner
        if planner.task.degrade is not None or not planner.faults or self._has_asked:
            return False
        if self._fewer is None:
            self._fewer = fewer_rows_hold(planner, self._path, self.progress, self._lead.given_up)
        try:
            next(self._fewer)
        except StopIteration as found:
            self._has_asked = True
            for _ in range(found.value):
                self._lead.give_up()
            if found.value:
                self.resume()
            return bool(found.value)
        return True

    def _try(self, stall: StallEscape, pattern: int) -> None:
        """Draw the null space along a pattern."""
        if pattern == self._pattern:
            return
        self._pattern = pattern
        robot = self._planner.robot
        unit = np.where(robot.chain.prismatic, self._lead.length, 1.0)
        along = stall.drive(stall.patterns[pattern], self._lead.working)
        self._state.drive[: robot.nv] = stall.speed * unit * along
        self._state.driven = 1

    def _rest(self) -> None:
        """End the escape, and the verdict with it."""
        self._pattern = None
        self._blockage = self._bridge = self._spot = self._fewer = None
        self._has_asked = False
        self._state.driven = self._state.found = 0
        self._state.aside = 0.0
        self._state.speed = 0.0
