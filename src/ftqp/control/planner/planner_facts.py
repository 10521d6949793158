"""What can be read of a planner between its steps."""

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from ftqp.control.drive.joint_drive import Drive, Noise
from ftqp.control.inverse_kinematics.passable import Passable, Walled
from ftqp.control.planner.arm_loop import ArmLoop
from ftqp.control.planner.constraint_list import Constraints
from ftqp.control.planner.degrading import fewer_rows
from ftqp.control.planner.leading_plan import LeadingPlan, PlanLeading
from ftqp.control.planner.planner_view import PlannerView
from ftqp.control.planner.response.fault_response import FaultResponse
from ftqp.control.planner.settings import Settings
from ftqp.control.planner.surroundings import Surroundings
from ftqp.control.planner.task_list import TaskList
from ftqp.control.planner.wanted import Wanted
from ftqp.control.scene.keeping_clear import Clearance
from ftqp.control.scene.placed_shapes import Scene
from ftqp.control.task.bounds import Bounds
from ftqp.control.task.keep import Keep
from ftqp.control.task.resolvers import Resolver
from ftqp.control.task.scheme import Scheme
from ftqp.control.task.task import EmergencyStop, Task
from ftqp.core.checks import FloatArray, array, frozen
from ftqp.core.errors import InputError
from ftqp.core.fixed import Fixed
from ftqp.core.html_table import html_table
from ftqp.faults.detection.diagnosis import Diagnosis, Finding
from ftqp.faults.kinds import Fault
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.payload import Payload
from ftqp.model.robot import Robot
from ftqp.model.robot_table import arm_svg

LEAST_LOAD = 0.05
"""A load lighter than this [kg] is not named, because friction that is not learned yet looks like so much."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Learned:
    """What the arm has beside its model, as learned since ``reset``.

    Attributes:
        rotors: Inertia of each joint's rotor beside that of the model, (nv,) [kg m2 or kg]; negative where
            the model has too much.
        rotors_error: Their standard deviations, (nv,); large for joints that were hardly accelerated.
        friction: Dry friction of each joint, (nv,) [N m or N], that of the model included, as it is not fed
            forward.
        delay: How much later samples come than the drive's ``latency`` says [s], as far as the arm has
            shaken, which alone tells.
        payload: The load at the tip beside what the planner carries, as a point mass; None is none.
    """

    rotors: FloatArray
    rotors_error: FloatArray
    friction: FloatArray
    delay: float
    payload: Payload | None

    def facts(self) -> dict[str, Any]:
        """The same as anything JSON can hold, for logs: ``payload`` has its mass and its centre."""
        load = self.payload
        return {
            "rotors": self.rotors.tolist(),
            "rotors_error": self.rotors_error.tolist(),
            "friction": self.friction.tolist(),
            "delay": self.delay,
            "payload": None if load is None else {"mass": load.mass, "com": load.com.tolist()},
        }


def learned(session: Session, joints: int) -> Learned | None:
    """What the planner of this session has learned; None where it does not learn, or has not begun."""
    K = session.K
    room, chain = K.learned, K.chain
    if not room.on or not room.based:
        return None
    mass, payload = float(room.load[0]), None
    if mass > LEAST_LOAD:
        away = np.array(room.load[1:4]) / mass - chain.tip_translation
        payload = Payload(mass, np.reshape(chain.tip_rotation, (3, 3)).T @ away)
    return Learned(
        rotors=frozen(room.rotor[:joints]),
        rotors_error=frozen(room.sigma[:joints]),
        friction=frozen(room.friction[:joints]),
        delay=float(room.later) * float(K.state.dt),
        payload=payload,
    )


def planner_html(planner: Any) -> str:
    """What a planner was made with, its tasks and constraints, and what it believes now."""
    robot, task = planner.robot, planner.task
    rows = [
        ("robot", f"{robot.name}, {robot.nv} joints"),
        ("tick", f"{1e3 * planner.dt:g} ms, {planner.level} level"),
        ("scheme, solver", f"{planner.scheme.name}, {planner.backend}"),
        (f"task of {robot.tip}", f"{', '.join(planner.task_rows)}; {task.mode}"),
    ]
    rows += [
        (f"task {name}", f"{type(one.given).__name__}, level {one.given.level}, weight {one.weight:g}")
        for name, one in planner.tasks.items()
    ]
    rows += [(f"constraint {name}", type(one.given).__name__) for name, one in planner.constraints.items()]
    believed = [f"{joint} {fault.happens}" for joint, fault in planner.faults.items()]
    note = f"It believes that {', '.join(believed)}." if believed else "It believes that every joint works."
    stopped = planner.stopped_because
    return html_table(
        f"Planner of {robot.name}",
        (),
        rows,
        f"{note} Stopped: {stopped}." if stopped else note,
        arm_svg(robot, robot.neutral),
    )


ANEW = "the planner was laid out for it; make another one, ftqp.Planner(robot, {name}=...)"
"""What to do about an attribute that a planner was made with."""


class PlannerFacts:
    """What a planner believes, has found and has been given, to be read between steps."""

    __slots__ = (
        "__weakref__",
        "_constraints",
        "_fault_response",
        "_given",
        "_leading",
        "_loop",
        "_session",
        "_surroundings",
        "_tasks",
        "_wanted",
    )
    _given: Settings
    _session: Session
    _loop: ArmLoop
    _leading: PlanLeading | None
    _fault_response: FaultResponse | None
    _tasks: TaskList
    _constraints: Constraints
    _surroundings: Surroundings | None
    _wanted: Wanted

    robot: Fixed[Robot] = Fixed(
        "_wanted.fitting.robot",
        "The arm as it is fitted now, with its load and tool.",
        "planner.carry(payload) mounts a load, planner.tool(T) a tool; for another arm make another planner",
    )
    dt: Fixed[float] = Fixed("_given.dt", "The sampling period [s].", ANEW)
    level: Fixed[str] = Fixed("_given.level", "``acceleration`` or ``velocity``, what the QP decides.", ANEW)
    task: Fixed[Task] = Fixed("_given.task", "Which rows of the pose are followed, and how.", ANEW)
    tasks: Fixed[TaskList] = Fixed(
        "_tasks",
        "The further tasks by name; their weights and targets may be changed between steps.",
        ANEW,
    )
    constraints: Fixed[Constraints] = Fixed(
        "_constraints", "Points that are kept on their side of a plane, and rows of your own, by name.", ANEW
    )
    scheme: Fixed[Scheme | Resolver] = Fixed("_given.scheme", "What the arm does with its redundancy.", ANEW)
    bounds: Fixed[Bounds] = Fixed("_given.bounds", "How limits become intervals.", ANEW)
    emergency: Fixed[EmergencyStop | None] = Fixed(
        "_given.emergency", "When it stops the arm of its own accord; None: never.", ANEW
    )
    posture: Fixed[FloatArray | None] = Fixed(
        "_given.posture", "Where ``rmp`` and ``dlsm`` return to, (nv,) [rad or m].", ANEW
    )
    drive: Fixed[Drive] = Fixed("_given.drive", "What the arm takes.", ANEW)
    noise: Fixed[Noise] = Fixed("_given.noise", "How noisy the measurements are.", ANEW)
    backend: Fixed[str] = Fixed("_given.backend", "Name of the solver.", ANEW)
    plan: Fixed[LeadingPlan | None] = Fixed(
        "_given.plan", "What leads the null space; None without one.", ANEW
    )
    faults: Fixed[dict[str, Fault]] = Fixed(
        "_wanted.belief.faults",
        "The faults believed now, by joint name; a copy.",
        "planner.report(fault) believes one more, planner.withdraw(joint) one less",
    )
    payload: Fixed[Payload | None] = Fixed(
        "_wanted.fitting.payload",
        "The load that is carried beside the robot's own bodies; None is none.",
        "planner.carry(payload) mounts a load, planner.carry(None) puts it down",
    )
    stopped_because: Fixed[str | None] = Fixed(
        "_loop.stopped_because",
        "Why a stop is latched, in a sentence that names the joint; None while none is.",
        "planner.stop() stops the arm, planner.resume() lets it go on",
    )
    pace: Fixed[float] = Fixed(
        "_loop.pace",
        "How fast the arm is led now, in (0, 1]: ``speed``, less what a detector's suspicion takes of it.",
        "planner.speed = share asks for another one",
    )

    def __repr__(self) -> str:
        failed = ", ".join(self.faults)
        return (
            f"Planner({self.robot.name}, {self.robot.nv} joints, dt={self.dt:g} s, {self.level} level, "
            f"failed: {failed or 'none'})"
        )

    def _repr_html_(self) -> str:
        """What it was made with and what it believes, for notebooks."""
        return planner_html(self)

    @property
    def scene(self) -> Scene | None:
        """What stands around the arm; None where it keeps clear of nothing."""
        return None if self._surroundings is None else self._surroundings.scene

    @property
    def clearance(self) -> Clearance | None:
        """How far it keeps from itself and from the scene; None where it keeps clear of nothing."""
        return None if self._surroundings is None else self._surroundings.clearance

    @property
    def pairs_left_out(self) -> tuple[tuple[str, str], ...]:
        """Pairs of the arm's own bodies that are built too near to each other to be kept apart, by name."""
        return () if self._surroundings is None else self._surroundings.left_out

    def distances(self, q: Any) -> dict[tuple[str, str], FloatArray]:
        """The distance of each pair of bodies that are kept apart [m], by their names.

        Args:
            q: A configuration, (nv,) or (nq,), for a number each, or several of them, (S, nv), for (S,) each
                [rad or m].

        Raises:
            InputError: A wrong shape, or a planner without a scene.
        """
        known = self._kept_clear()
        if np.ndim(q) == 2:
            return known.distances(array("q", q, (len(q), self.robot.nv), "(S, nv)"))
        return {names: d[0] for names, d in known.distances(self.robot.angles(q)[None]).items()}

    def _kept_clear(self) -> Surroundings:
        """What it keeps clear of.

        Raises:
            InputError: Nothing.
        """
        if self._surroundings is None:
            raise InputError("the planner keeps clear of nothing; give it a scene, Planner(robot, scene=...)")
        return self._surroundings

    @property
    def task_rows(self) -> tuple[str, ...]:
        """The rows of the pose that the task has, of x, y, z, rx, ry, rz."""
        task = self._session.K.task
        return tuple(COMPONENTS[c] for c in task.rows[: int(task.m)])

    @property
    def kept_rows(self) -> str | tuple[str, ...]:
        """The rows that are asked for now: ``position_axis``, or names, as searches take them."""
        return "position_axis" if self._session.K.task.tool_rows else self.task_rows

    @property
    def given_up(self) -> str | None:
        """What of the task is given up now, as it cannot be held, in a sentence; None while all counts."""
        task = self._session.K.task
        return fewer_rows(int(task.m)) if task.given_up else None

    @property
    def tick(self) -> int:
        """Number of the step, from 0 at the first one after ``reset``; -1 before it."""
        return int(self._session.K.state.ticks) - 1

    @property
    def disturbance(self) -> FloatArray:
        """Torque that acts on the joints beside the model, as observed, (nv,) [N m or N]; a copy.

        It is known of a torque arm only, 0 for failed joints, and NaN with another drive.
        """
        return self._loop.disturbance

    @property
    def learned(self) -> Learned | None:
        """What a torque arm has beside its model, as learned since ``reset``: rotors, friction, a load.

        None with another drive, before the first step, and with ``inertia_error=0``. A load or rotors that
        are known by now may be told: ``planner.carry(planner.learned.payload)``, ``robot.with_rotors(...)``.
        """
        return learned(self._session, self.robot.nv)

    @property
    def touch(self) -> FloatArray | None:
        """The force that seems to push the tip of a torque arm, (3,) [N], along the base's axes.

        A force at the tip shows up in many joints at once, a motor that does not obey in its own: where the
        force explains what is unusual much better no joint is suspected. None while nothing pushes, with
        another drive, and while a joint is known to have failed. What lasts longer than 1 s is a load.
        """
        return self._loop.touch

    @property
    def diagnosis(self) -> Diagnosis | None:
        """What the detector holds for likely; None without one."""
        return None if self._fault_response is None else self._fault_response.diagnosis

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What the detector has found since ``reset`` and the planner acted upon, in order."""
        return () if self._fault_response is None else tuple(self._fault_response.findings)

    def view(self) -> PlannerView:
        """The planner's own state and belief, to be read: for what is built around it."""
        return PlannerView(self._session, self.robot)

    def passable(self, walled: Walled | None = None) -> Passable:
        """What says where the arm may be, as believed now: its motors, kept points, itself and its scene.

        Args:
            walled: What the tip is to stay in beside; None is anywhere.
        """
        view = self.view()
        keeps = [one.given for one in self._constraints.values() if isinstance(one.given, Keep)]
        return Passable(self.robot, view.limits.tau, view.working, keeps, self, walled)

    def session(self) -> Session:
        """A copy of all that the planner knows, for studies of what is in it."""
        return self._session.copy()

    @property
    def plan_time(self) -> float | None:
        """The time of the plan at which the tip is [s]; None without a plan."""
        return None if self._leading is None else self._leading.at
