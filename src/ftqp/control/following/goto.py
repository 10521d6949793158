"""Going to a pose or a posture and resting there, whatever fails on the way."""

import logging
from typing import Any, final

import numpy as np

from ftqp.control.following.goto_status import (
    ONLY_THE_TIP,
    ConvergenceMonitor,
    GoToStatus,
    is_held,
    missed_by,
    missed_joints,
    overlap,
    posture_inside,
)
from ftqp.control.following.tip_tracker import HELD_BACK, FrameOfTip, TipTracker
from ftqp.control.planner.mounted_robot import in_millimetres, out_of_reach
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.planner_view import JointState
from ftqp.control.planner.status import with_reason
from ftqp.control.planner.step import Step
from ftqp.control.planner.ways.joint_tracker import JointTracker
from ftqp.control.planner.ways.way_out import WayOut
from ftqp.control.planner.ways.ways import refusal
from ftqp.control.references.jerk_limit import TipLimits
from ftqp.core.checks import FloatArray, frozen, instance, positive
from ftqp.core.errors import InputError
from ftqp.core.fixed import MADE, Fixed
from ftqp.core.pose import pose as checked_pose
from ftqp.core.pose import rotation_vector
from ftqp.kernel.layout.enums import HELD, STOPPED, STOPPING, Going
from ftqp.kernel.layout.thresholds import AT_REST, EXACT, PATIENCE, RESTLESS_PATIENCE, RISE_TIME

_LOG = logging.getLogger("ftqp")
SETTLED = 0.1
"""Share of the tolerances within which an arm at its pose is not waited for any longer."""

MAX_WAYS = 4
"""So many other ways are gone before the arm stays where it is."""


@final
class GoTo:
    """Moves an arm to a pose of its end effector or to a posture of all joints, where it rests.

    Both are motions of the joints, as fast as the limits that are believed allow, with limited jerk and
    within every limit of the planner; on the way to a pose the end effector goes straight where the joints
    can follow that. In a scene, or where distances are kept, the motion is proven free before it begins.
    When a joint fails, the way is planned anew at the same tick from the position and velocity of the
    command: the others go to their places, or the end effector as near as it gets. Where the joints cannot
    follow the straight way to a pose, postures of the goal are looked for, a little in every tick, while
    the arm comes to rest, and the joints go to one to which there is a way. A goal that is not reached is
    reported as ``UNREACHABLE`` together with the distance and with what was looked for, once the arm rests.
    An arm that oscillates next to a pose goes back to where it was nearest and its motors can hold it, and
    rests there; else the planner stops it.

    Args:
        planner: The planner that it commands; with any scheme, task and backend.
        pose: Where the end effector shall rest, (4, 4), for tasks with or without rotation rows.
        q: Where the joints shall rest, (nv,) or (nq,) [rad or m], inside their limits.
        way: One of ``planner.ways_out()``, to whose places the joints go one after the other.
        limits: How fast the end effector moves to a pose; None is ``TipLimits()``. The joints' own limits set
            the pace to a posture.
        rise_time: How long the joints' accelerations take to reach their limits on the way to a posture, > 0
            [s]. A longer one is softer and later. A joint with a jerk limit ``j_max`` keeps that, too.
        tolerance: How near the end effector, or every joint, has to be to its goal, > 0 [m or rad].
        rotation_tolerance: How near the attitude of the end effector has to be to its goal, > 0 [rad].
        straight: Whether the end effector may go to a pose on its straight way only, for example because
            other ways are not free; then no postures are looked for.
        task: The further task whose frame goes to ``pose``, a ``PoseTask`` or ``PositionTask`` of the
            planner's list, by its name; None is the end effector. Its target is then this motion's, and no
            postures are looked for.

    Raises:
        InputError: Neither or both of pose and q, a wrong shape, a pose that is none or twenty times as far
            away as the arm is long, or a posture outside the limits.

    Source: docs/theory/ways-to-a-goal.md, docs/theory/ways-out.md.
    """

    __slots__ = (
        "_aim", "_approach", "_asked", "_joints", "_least", "_leg", "_limits",
        "_looked_for", "_nearest", "_only_the_tip", "_planner", "_pose", "_refusal", "_rotation_tolerance",
        "_settling", "_status", "_stopped", "_taken", "_tip", "_to_posture", "_tolerance",
        "_turned_back", "_view",
    )  # fmt: skip

    planner: Fixed[Planner] = Fixed("_planner")
    pose: Fixed[FloatArray] = Fixed("_pose", "Where the end effector shall rest, (4, 4); read-only.", MADE)

    def __init__(
        self,
        planner: Planner,
        pose: Any = None,
        *,
        q: Any = None,
        way: WayOut | None = None,
        limits: TipLimits | None = None,
        rise_time: float = RISE_TIME,
        tolerance: float = 1e-3,
        rotation_tolerance: float = 5e-3,
        straight: bool = False,
        task: str | None = None,
    ) -> None:
        instance("planner", planner, Planner, "an ftqp.Planner, ftqp.Planner(robot)")
        if sum(goal is not None for goal in (pose, q, way)) != 1:
            raise InputError(
                "a GoTo needs exactly one of pose, q and way; pose is of the end effector, q of all joints, "
                "way one of planner.ways_out()"
            )
        instance(
            "limits", limits, TipLimits | None, "ftqp.TipLimits(...), ftqp.TipLimits(speed=0.25), or None"
        )
        self._planner = planner
        self._tolerance = positive("tolerance", tolerance, "m or rad")
        self._rotation_tolerance = positive("rotation_tolerance", rotation_tolerance, "rad")
        rise_time = positive("rise_time", rise_time, "s")
        self._tip: TipTracker | None = None
        self._limits = TipLimits() if limits is None else limits
        self._asked: dict[str, Any] | None = None  # of other ways
        self._to_posture = pose is None
        if task is not None and pose is None:
            raise InputError(f"task={task!r:.60} goes to a pose; give pose=..., or leave task out")
        if pose is not None:
            self._pose = frozen(checked_pose(pose, "pose"))
            if said := in_millimetres(planner.robot, self._pose[:3, 3], "the pose is {} m from the base"):
                raise InputError(said)
            self._tip = TipTracker(planner, self._limits, task, whole=True)
            self._view = self._tip.view
            self._joints = JointTracker(planner, self._view.command.q, rise_time, tolerance=self._tolerance)
            if not straight and isinstance(self._tip.frame, FrameOfTip):
                self._asked = {"goal": self._pose, "tolerance": (self._tolerance, self._rotation_tolerance)}
        else:
            if limits is not None:
                raise InputError(
                    "limits are those of the end effector's way to a pose; for a posture leave them out"
                )
            instance("way", way, WayOut | None, "one of planner.ways_out()")
            goal = posture_inside(planner.robot, q) if way is None else way.places[-1]
            self._joints = JointTracker(planner, goal, rise_time, tolerance=self._tolerance)
            if way is not None and len(way.places) > 1:
                self._joints.seek(goal, places=way.places)
            elif way is None and not straight:
                self._joints.seek(goal)
            self._view = self._joints.view
            rest = np.zeros(len(goal))
            self._pose = frozen(self._view.tip_at(JointState(goal, rest, rest)).pose)
        if way is not None:
            way.close_brakes(planner)
            # it says where joints that had failed stand, and not where they shall
            self._joints.counts[:] = self._view.working | ~np.isin(planner.robot.joints, way.failed)
        self._approach = ConvergenceMonitor(planner.dt)
        self._begin()

    def _begin(self) -> None:
        self._status = GoToStatus.MOVING
        self._least = np.inf
        self._approach.begin()
        self._settling = self._turned_back = self._only_the_tip = False
        self._aim, self._nearest = self._pose, np.zeros(0)
        self._leg: TipTracker | JointTracker = self._joints if self._tip is None else self._tip
        self._leg.begin()
        self._taken, self._looked_for = 0, ""
        self._refusal: str | None = None
        if self._asked is None:
            return
        planner = self._planner
        self._refusal = refusal(planner)
        if not self._refusal and not planner.avoids:  # in a scene a free way nears it
            self._refusal = out_of_reach(planner.robot, self._pose[:3, 3])
        if not self._refusal and not planner.tasks:
            self._leg, self._taken = self._joints, 1
            self._joints.seek(None, straight=self._limits, nears=True, **self._asked)

    def reset(self, q: Any, v: Any = None) -> None:
        """Begin anew at (q, v), see ``Planner.reset``.

        Args:
            q: The measured configuration, (nv,) joint values or (nq,) [rad or m].
            v: The measured velocity, (nv,) [rad/s or m/s]; None is rest.
        """
        self._planner.reset(q, v)
        self._begin()

    def step(self, q: Any, v: Any = None, *, target: Any = None, tau: Any = None, tip: Any = None) -> Step:
        """The command for the next ``dt``; see ``Planner.step``.

        Args:
            q: The measured configuration, (nv,) joint values or (nq,) [rad or m].
            v: The measured velocity, (nv,) [rad/s or m/s], or None: the planner observes it from q.
            target: What the others do meanwhile on the way to a pose: a table of targets by task, or the
                end effector's target where another task is led. None leaves them as they are, and an end
                effector that is not led where it was.
            tau: The measured torque, (nv,) [N m or N], or None.
            tip: The measured pose of the end effector, (4, 4), or None to take that of the model.

        Raises:
            InputError: As ``Planner.step``, or a target on the way to a posture.
        """
        if target is not None and self._to_posture:
            raise InputError(
                "a posture takes all joints, so that there is no target next to it; leave it out"
            )
        if self._joints.begins_anew():
            self._begin()  # a joint has failed or works again, or somebody else has led the planner
        leg = self._leg
        if isinstance(leg, TipTracker):
            step = leg.step(
                q,
                v,
                pose=self._aim,
                twist=np.zeros(6),
                tau=tau,
                tip=tip,
                waits=not self._settling,
                beside=target,
            )
        else:
            step = leg.step(q, v, tau, tip)
        self._joints.goes_on()
        self._judge(step)
        return step

    @property
    def status(self) -> GoToStatus:
        """Where the arm stands on its way."""
        return self._status

    @property
    def done(self) -> bool:
        """Whether nothing more will happen: reached, as near as it gets, or stopped by the planner."""
        if self._status is GoToStatus.HALTED:
            return self._stopped
        return self._status is not GoToStatus.MOVING

    @property
    def joint_error(self) -> FloatArray | None:
        """From the commanded joints to the goal, (nv,) [rad or m]; None on the way to a pose."""
        return self._joints.way if self._to_posture else None

    @property
    def position_error(self) -> float:
        """How far the command is from the goal, for a posture from where that puts the end effector [m]."""
        return self._errors_at(self._view.command.q)[0]

    @property
    def rotation_error(self) -> float:
        """Angle of the commanded end effector, or frame, from its goal [rad]."""
        return self._errors_at(self._view.command.q)[1]

    @property
    def way(self) -> FloatArray | None:
        """Places of the way round that was found, from where the arm stood, (k, nv) [rad or m]; or None."""
        found = self._joints.searched
        return found.way if found is not None and found.has_way else None

    @property
    def _who(self) -> str:
        return "the end effector" if self._tip is None else self._tip.frame.label

    def _errors_at(self, q: FloatArray) -> tuple[float, float]:
        """How far what goes to the goal is from it with the joints at q [m], and its angle [rad]."""
        rest = np.zeros(len(q))
        joints = JointState(q, rest, rest)
        pose = (self._view.tip_at(joints) if self._tip is None else self._tip.frame.state_at(joints)).pose
        way = float(np.linalg.norm(self._pose[:3, 3] - pose[:3, 3]))
        return way, float(np.linalg.norm(rotation_vector(self._pose[:3, :3] @ pose[:3, :3].T)))

    @property
    def sentence(self) -> str:
        """Where the arm stands and why, which joints miss their goal, and how far off the end effector is."""
        if self._status is GoToStatus.REACHED:
            return ONLY_THE_TIP if self._only_the_tip else self._status.value
        if self._status is GoToStatus.HALTED:
            return "; ".join([with_reason(self._status.value, self._planner.stopped_because), *self._missed])
        heavy = self._joints.too_heavy
        weak = [] if heavy is None else [f"{heavy} is too weak to hold the arm farther on"]
        blocked = self._joints.blocked
        why = weak + ([] if blocked is None else [blocked])
        said = [*self._missed, *(why if self._to_posture else [self.note])]
        return f"{self._status.value}: {'; '.join(said)}" if said else self._status.value

    @property
    def _missed(self) -> list[str]:
        """What touches, and what the arm, as it is measured, misses of its goal: joints, and then the tip."""
        view, joints, robot = self._view, self._joints, self._planner.robot
        measured, whose = view.measured, "goal"
        said = overlap(self._planner.distances(measured)) if self._planner.clearance else []
        way = joints.way_from(measured)
        if not self._to_posture:  # its joints are at fault where they are not where they were sent
            led = self._status is GoToStatus.UNREACHABLE
            way, whose = joints.way_from(measured) - joints.way if led else np.zeros(len(measured)), "command"
        off = missed_joints(robot, way, self._planner.faults, self._tolerance)
        tip = self._missed_by_tip
        said += [f"off their {whose} are {', '.join(off)}"] if off else []
        return [*said, f"{self._who} is {tip} from it"] if tip else said

    @property
    def _missed_by_tip(self) -> str:
        """By how much the tip, as it is measured, misses its goal; empty where it does not."""
        turns = self._to_posture or any(row.startswith("r") for row in self._planner.task_rows)
        tolerances = self._tolerance, self._rotation_tolerance if turns else np.inf
        return missed_by(*self._errors_at(self._view.measured), tolerances)

    @property
    def note(self) -> str:
        """What is being done, and what was looked for, in a sentence."""
        joints, leads_joints = self._joints, self._leg is self._joints
        goes_straight, thinks = leads_joints and joints.goes_straight, leads_joints and joints.is_searching
        if self._status is GoToStatus.MOVING and thinks and not goes_straight:
            cannot = "is not free" if self._to_posture else "cannot be gone"
            return f"the straight way {cannot}, and another one is looked for"
        if self._to_posture or self._status in (GoToStatus.HALTED, GoToStatus.REACHED):
            return self._status.value
        if leads_joints and joints.only_nears and joints.blocked is not None:
            return joints.blocked
        if self._is_on_other_way and not goes_straight:
            return f"the joints go to another posture of the goal: way {self._taken} of at most {MAX_WAYS}"
        if self._looked_for:
            return self._looked_for
        if self._refusal:
            return f"no other way was looked for: {self._refusal}"
        return f"{self._who} goes straight"

    def _judge(self, step: Step) -> None:
        """Reached, no nearer any more, stopped, or still on the way."""
        joints = self._joints
        if self._to_posture:
            if joints.state is Going.RESTLESS:
                self._end_swing(there=False)
            else:
                self._status, self._stopped = GoToStatus[joints.state.name], step.code == STOPPED
            return
        if step.code in (STOPPING, STOPPED):
            self._status = GoToStatus.HALTED
            self._stopped = step.code == STOPPED
            return
        if self._status is GoToStatus.HALTED:
            self._begin()
        if self._status is not GoToStatus.MOVING or step.code == HELD:
            return
        if self._leg is joints:
            if joints.is_on_way:
                return
            if self._asked is not None and joints.blocked is not None and not joints.only_nears:
                self._looked_for, self._taken = joints.blocked, MAX_WAYS
                self._go_straight()
            elif joints.state is not Going.MOVING:
                self._rest(np.inf)
            return
        tip = self._leg
        assert isinstance(tip, TipTracker)
        commanded, measured = self._distances(tip, step)
        approach, speed = self._approach, self._view.pace
        approach.look(speed, measured <= 1.0)
        if commanded <= EXACT and speed < AT_REST and measured <= 1.0:
            self._rest(measured)
            return
        distance = max(commanded / self._tolerance, measured)
        if self._settling and distance < self._least and is_held(self._view):
            self._least, self._nearest = distance, self._view.command.q
        held_back = not self._settling and tip.behind > HELD_BACK
        if approach.is_nearer(distance):
            return
        if not self._settling and not held_back and tip.reference.twist.any():
            approach.wait(for_rest=True)  # the reference is as slow as it is to be
        waited = approach.waited
        if not self._settling:
            if waited > PATIENCE or tip.frame.holds(step):
                if measured > 1.0 and self._goes_round():
                    return
                self._settling = True  # the reference goes on and stands
                approach.wait()
        elif tip.reference.twist.any():
            approach.wait(for_rest=True)
        elif approach.stood > PATIENCE:
            self._rest(measured)
        elif waited > RESTLESS_PATIENCE:
            self._end_swing(approach.stayed > PATIENCE)

    def _goes_round(self) -> bool:
        """Let the joints go another way, if one may be looked for; whether they do."""
        if self._asked is None or self._refusal or self._taken >= MAX_WAYS:
            return False
        _LOG.info("the straight way cannot be gone; other postures of the goal are looked for")
        self._taken += 1
        self._joints.seek(None, **self._asked)
        self._begin_on(self._joints)
        return True

    def _go_straight(self) -> None:
        """Let the tip go straight on to the goal."""
        assert self._tip is not None
        self._tip.begin()
        self._begin_on(self._tip)

    def _begin_on(self, leg: TipTracker | JointTracker) -> None:
        """Let one of both lead from now on."""
        self._leg = leg
        self._least = np.inf
        self._approach.begin()
        self._settling = self._turned_back = False
        self._aim = self._pose

    @property
    def _is_on_other_way(self) -> bool:
        return self._leg is not self._tip and not self._to_posture

    def _rest(self, measured: float) -> None:
        """The verdict on an arm at rest, so many tolerances from where it was led."""
        if self._is_on_other_way:
            measured = np.inf if self._missed_by_tip else 0.0
            if measured > 0.0 and not self._joints.only_nears:
                self._go_straight()
                return
        there = measured <= 1.0 and self._aim is self._pose
        self._status = GoToStatus.REACHED if there else GoToStatus.UNREACHABLE

    def _end_swing(self, there: bool) -> None:
        """Lead an arm that does not come to rest to where it was nearest and can be held, or stop it."""
        if self._is_on_other_way:
            self._rest(np.inf)
        elif there and self._tip is not None:
            self._status, self._only_the_tip = GoToStatus.REACHED, True
        elif self._tip is None or self._turned_back or self._least == np.inf:
            _LOG.warning(
                "the arm does not come to rest near its goal, so its planner stops it; call resume() or "
                "reset() to go on"
            )
            self._planner.stop()
        else:
            rest = np.zeros(len(self._nearest))
            self._aim = self._tip.frame.state_at(JointState(self._nearest, rest, rest)).pose
            self._approach.begin()
            self._settling, self._turned_back = False, True
            self._tip.begin()

    def _distances(self, tip: TipTracker, step: Step) -> tuple[float, float]:
        """The command's distance from the goal, and the arm's over the tolerances."""
        reference = tip.reference
        left = float(np.linalg.norm(self._aim[:3, 3] - reference.p))
        turn = float(np.linalg.norm(rotation_vector(self._aim[:3, :3] @ reference.R.T)))
        missed, turned = tip.frame.distances(step)
        position, rotation = left + missed, turn + turned
        far = max(position / self._tolerance, rotation / self._rotation_tolerance)
        return max(left, turn) if far <= SETTLED else max(position, rotation), far

    def __repr__(self) -> str:
        return f"GoTo({self._planner.robot.name}, {self._status.name})"
