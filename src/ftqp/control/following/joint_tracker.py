"""A planner led by a motion of the joints to a posture, straight or round what is in between."""

from typing import Any, Final, final

import numpy as np

from ftqp.control.following.tip_tracker import OFF_TASK
from ftqp.control.planner.joint_motion import JointMotion
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.planner_view import PlannerView
from ftqp.control.planner.step import Step
from ftqp.control.planner.ways.ways import Ways
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.kernel.layout.ways_room import WayStage

LOOKS_A_SECOND: Final = 50_000
"""Looks at postures for the time between two ticks [1/s], which take a sixth of a processor
(``python benchmarks/ft_mbm.py``)."""
AT_ONCE: Final = 4
"""So many times as many while the arm brakes: the sooner there is a motion, the faster the arm still is when
it goes over into it. A guess."""
WAITS, STANDS = 2e-3, 1e-2
"""A command that is farther than this from its motion [rad or m], as something holds it back, slows it down;
where it is as far as the second, the motion stands."""
HURRY: Final = 0.05
"""The pace of the motion changes from rest to full in so much time at least [s]."""
STUCK: Final = 0.5
"""A motion that has stood for so long is planned anew [s]. A guess."""
MAX_TRIES: Final = 4
"""So many times at most."""
SAME: Final = 1e-6
"""Places nearer to each other than this are one [rad or m]. A convention."""
BRAKES: Final = 2.0
"""While joints that have failed brake, no way is looked for, so long in all at most [s]. A guess."""
RESTS, SETTLES = 1e-4, 0.3
"""A command so near to where it was to come to rest is there [rad or m]; held off, it is after so long
[s]. Conventions."""


def looks_per_tick(dt: float) -> int:
    """Looks at postures between two ticks of so long [s]."""
    return max(10, round(LOOKS_A_SECOND * dt))


@final
class JointTracker:
    """The planner's steps along a jerk-limited motion of the joints that work.

    It is planned from the last command, anew at the very tick at which the belief in a joint or a limit
    changes, or ``planner.pace``, so that position and velocity go on without a jump. Where a way is sought,
    the arm comes to rest, the way is looked for, a little in every tick, straight first, and its motion is
    played. It waits where the planner holds it back, and what is left of it is proven anew when the scene
    changes.

    Attributes:
        motion: The motion, straight or as it is played.
        blocked: Why there is no way; None while that is not known.
        searched: What has looked for the last way.
    """

    def __init__(
        self,
        planner: Planner,
        goal: FloatArray,
        rise_time: float,
        meant: FloatArray | None = None,
        *,
        whole: bool = True,
    ) -> None:
        self.planner = planner
        self.view: PlannerView = planner.view()
        self.motion = JointMotion(self.view, planner.robot, planner.dt, planner.level, rise_time)
        self.motion.goal = goal
        self._lead = planner.lead(self.motion.memory, meant)
        self._looks, self._asked = looks_per_tick(planner.dt), dict[str, Any]()
        self._t, self._rise_time = 0.0, rise_time
        self._whole = whole
        self._begun, self._belief, self._speed, self._scene = -1, b"", 1.0, -1
        self._aim(goal, seeks=False)

    def _aim(self, goal: FloatArray, seeks: bool) -> None:
        self._goal, self._seeks, self._tries = goal, seeks, 0
        self._left, self._brakes, self._is_late = 0, BRAKES, False
        self.motion.goal = goal
        self.begin()

    def begin(self) -> None:
        """Let the next step begin at the arm."""
        self._begun = -1
        self.motion.forget()
        self._ways: Ways | None = None
        self.searched: Ways | None = None
        self._proof: Ways | None = None
        self._rest: FloatArray | None = None
        self._plays, self._rate, self._stood = False, 1.0, 0.0
        self.blocked: str | None = None
        if self._whole:
            self.view.keep_rows()

    def aim(self, goal: FloatArray) -> None:
        """Go straight to another posture from the next step on."""
        self._asked = {}
        self._aim(goal, seeks=False)

    def seek(self, q: FloatArray | None, **asked: Any) -> None:
        """Go to another posture from the next step on, round what is in between.

        What else is ``asked`` of ``Ways`` may be a tube, a pose whose postures are the goals, or places to
        go to before it, one after the other.
        """
        self._asked = asked
        self._aim(self.view.command.q if q is None else q, seeks=True)

    @property
    def is_searching(self) -> bool:
        """Whether a way is being looked for, and the arm stands meanwhile."""
        return self._ways is not None or ("goal" in self._asked and self._begun < 0 and not self._plays)

    @property
    def is_on_way(self) -> bool:
        """Whether a way is being looked for, or its motion is played and not over."""
        if self._plays:
            stuck = self._tries >= MAX_TRIES and self._stood > STUCK
            return not stuck and self.motion.moves_at(self._t)
        return self.is_searching

    @property
    def goes_straight(self) -> bool:
        """Whether the tip goes straight, as far as is known."""
        return "straight" in self._asked if self.searched is None else self.searched.goes_straight

    @property
    def only_nears(self) -> bool:
        """Whether the joints go to the nearest posture of a goal that has no clear one."""
        return self.searched is not None and self.searched.only_nears

    @property
    def way(self) -> FloatArray:
        """What is left of the way of every joint as commanded, (nv,) [rad or m]; the short way round."""
        return self.way_from(self.view.command.q)

    def way_from(self, q: FloatArray) -> FloatArray:
        """From joint positions to the goal, (nv,) [rad or m]; for a continuous joint the short way round."""
        return self.motion.way_from(q, self._goal)

    def judged(self, tolerance: float, counts: BoolArray) -> int:
        """Where the arm, as it is measured, stands on its way to the goal, as a ``Going``."""
        return self.motion.judged(self._goal, tolerance, counts)

    def step(self, q: Any, v: Any, tau: Any, tip: Any) -> Step:
        """A step on the way; see ``Planner.step``."""
        view = self.view
        if view.is_reset:
            belief, speed = view.belief, self.planner.pace
            paced = self._speed == speed or self._plays  # what is played goes at another pace
            if self._begun != view.ticks or self._belief != belief or not paced:
                self._belief, self._speed = belief, speed
                self._plan()
            elif self._seeks:
                self._think()
            self._pace()
            self.motion.write(self._t, self._rate)
        step = self._lead.step(q, v, (), tau, tip)
        self._t += self._rate * self.planner.dt
        off = step.code in OFF_TASK or (not self._plays and self.motion.is_left_at(self._t))
        self._begun = -1 if off else view.ticks
        return step

    def _plan(self) -> None:
        """Plan from the command: straight, or to rest while a way is looked for."""
        self._left += 1
        goes_on = self.blocked is not None or self._left > MAX_TRIES  # as near as it gets
        self._ways = self._proof = self._rest = None
        self._plays, self._rate, self._t = False, 1.0, 0.0
        self.motion.goal = self._goal
        self._scene = self._scene_now
        if self.blocked is None and (self._asked or (self._seeks and self.planner.avoids and not goes_on)):
            self._turn_round()
        else:
            self.motion.plan(self._speed)

    def _think(self) -> None:
        """Think of a way, or prove what is left of the motion, for a tick."""
        if self._proof is not None:
            self._proof.search_step(self._looks)
            if not self._proof.is_searching:
                is_free, self._proof = self._proof.is_free, None
                if not is_free:
                    self._turn_round(is_free=False)
        elif self._ways is not None:
            self._look_round()
        elif self._scene != self._scene_now and self.blocked is None:
            self._scene = self._scene_now
            self._prove_rest()

    def _prove_rest(self) -> None:
        """The scene has changed: prove what is left of the motion anew."""
        if not self._plays:
            self._begun = -1
            self._plan()
            return
        ways = Ways(self.planner, self.view.command.q, rise_time=self._rise_time)
        ways.prove_again(self.motion.table, min(int(self._t / self.planner.dt), len(self.motion.table) - 1))
        self._proof = ways

    def _turn_round(self, *, is_free: bool = True) -> None:
        """Come to rest, and look for a way from there meanwhile; the scene ``is_free`` as it was proven."""
        self._plays, self._rate, self._t, self._proof = False, 1.0, 0.0, None
        self._rest = self.motion.halt(is_free=is_free)
        goals, asked = [self._rest + self.motion.way_from(self._rest, self._goal)], dict(self._asked)
        if "goal" in asked:
            self._goal, goals = self._rest.copy(), []
        elif "places" in asked:
            asked["places"], goals = self._left_of(asked["places"]), []
        self._ways = self.searched = Ways(
            self.planner, self._rest, goals=goals, rise_time=self._rise_time, seed=self._tries, **asked
        )

    def _left_of(self, places: FloatArray) -> FloatArray:
        """The places that are left, from the nearest on where some were gone, with failed joints at rest."""
        rest = self._rest
        assert rest is not None
        first = int(np.abs(places - rest).max(axis=1).argmin()) if self._left > 1 else 0
        found, last = [], rest
        for place in places[first:]:
            step = np.where(self.view.working, self.motion.way_from(last, place), 0.0)
            if np.abs(step).max() > SAME:
                last = last + step
                found.append(last)
        return np.array(found).reshape(-1, len(rest))

    def _look_round(self) -> None:
        """Think of the way for a tick, and play it where the arm rests at its begin."""
        ways, rest = self._ways, self._rest
        assert ways is not None and rest is not None
        if self._scene != self._scene_now:
            self._scene = self._scene_now
            self._turn_round(is_free=False)
            return
        if self._brakes > 0.0 and self.view.command.v[~self.view.working].any():
            self._brakes -= self.planner.dt
            self._is_late = True
            return
        if self._is_late:
            self._is_late = False
            self._turn_round()
            return
        ways.search_step(AT_ONCE * self._looks if self.motion.moves_at(self._t) else self._looks)
        if ways.stage is WayStage.NO_WAY:
            self._give_up(ways.sentence)
        elif ways.stage is WayStage.READY:
            off = float(np.abs(self.view.command.q - rest).max())
            if self.motion.off_at(self._t) <= RESTS and self._joins(ways):
                return
            if self.motion.moves_at(self._t if off <= RESTS else self._t - SETTLES):
                return
            if off > WAITS and self._tries >= MAX_TRIES:
                self._give_up("the arm does not come to rest")
            elif off > WAITS:
                self._tries += 1
                self._turn_round()
            else:
                self._play(ways, ways.motion, 0.0)

    def _joins(self, ways: Ways) -> bool:
        """Go over from braking into the motion that was found, without a rest, where that is proven free."""
        joined = self.motion.joined(ways.motion, self._t)
        if joined is None or not ways.is_free:
            return False
        table, new = joined
        proof = Ways(self.planner, table[1], rise_time=self._rise_time)
        proof.prove_again(table[: new + 1], 1)
        proof.search_step(self._looks)
        if proof.is_searching or not proof.is_free:
            return False
        self._play(ways, table, self.planner.dt)
        return True

    def _play(self, ways: Ways, table: FloatArray, t: float) -> None:
        """Play the motion that was found, from a time on [s]."""
        self._ways, self._t, self._plays = None, t, True
        if "goal" in self._asked:
            self._goal = ways.way[-1]
        self.motion.follow(table, is_free=ways.is_free)

    def _give_up(self, why: str) -> None:
        """There is no way: go straight as near as it gets, where a straight one was asked for."""
        self.blocked, self._ways = why, None
        if not self._asked or "places" in self._asked:
            self.motion.goal, self._t = self._goal, 0.0
            self.motion.plan(self._speed)

    def _pace(self) -> None:
        """Let a motion that is played wait for an arm that is held back."""
        if not self._plays:
            return
        dt, off = self.planner.dt, self.motion.off_at(self._t)
        top = min(self.planner.pace / self._speed, 1.0)
        wanted = min(max((STANDS - off) / (STANDS - WAITS), 0.0), top)
        self._rate = min(max(wanted, self._rate - dt / HURRY), self._rate + dt / HURRY)
        self._stood = self._stood + dt if self._rate < 0.05 else 0.0
        if self._stood > STUCK and self._tries < MAX_TRIES:
            self._tries, self._stood = self._tries + 1, 0.0
            self._turn_round()

    @property
    def _scene_now(self) -> int:
        scene = self.planner.scene
        return 0 if scene is None else int(scene.version[0])
