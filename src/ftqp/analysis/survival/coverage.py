"""Which failures a motion survives: every joint, at every instant of a path."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Literal, final, get_args

import numpy as np

from ftqp.analysis.survival.continuing import path_values, track
from ftqp.analysis.survival.coverage_report import CoverageReport
from ftqp.analysis.survival.failure_instants import Pairs, refuse_no_masses
from ftqp.analysis.survival.task_path import MotionOnPath, TaskPath, task_path
from ftqp.analysis.survival.way_round import Bound, bound_of
from ftqp.analysis.tolerance import null_vector, relative_manipulability, structural_joints
from ftqp.control.paths import Path
from ftqp.control.scene.placed_shapes import Clearance, Scene
from ftqp.core.checks import FloatArray, IntArray, array, frozen, instance, positive, whole_number
from ftqp.core.errors import InputError
from ftqp.faults import kinds
from ftqp.kernel.entry.continuation_study import Continuations
from ftqp.kernel.layout.enums import Survival
from ftqp.model.frames import on_way
from ftqp.model.robot import Robot

FOLLOWED = (2e-3, 2e-2)
"""How far a motion may be off its path [m, rad]."""
LOST = 1e-9
"""Below this relative manipulability a jump has no answer."""

Fault = Literal["locked", "degraded", "free_swinging"]
FAULTS = get_args(Fault)


def coverage(
    robot: Robot,
    path: Any,
    q: Any,
    *,
    dt: float | None = None,
    stride: int = 4,
    lock: Literal["instant", "ramp"] = "instant",
    post: Literal["exact", "qp", "planner"] | None = None,
    rows: Any = None,
    joints: Any = None,
    fault: Fault = "locked",
    velocity: float = 0.5,
    deceleration: Any = None,
    tolerance: tuple[float, float] = FOLLOWED,
    upper_bound: int | None = None,
    scene: Scene | None = None,
    clearance: Clearance | None = None,
    threads: int | None = None,
    task: str | None = None,
    verified: "Callable[[CoverageCase], CoverageReport] | None" = None,
) -> CoverageReport:
    """Which failures a motion survives: each (joint, instant) is continued to the end of the path.

    Source: zhang2016, section 2.1; paredis1996; docs/theory/coverage.md.

    Args:
        robot: The arm.
        path: A path of ``ftqp.paths``, poses (N + 1, 4, 4), points (N + 1, 2) or (N + 1, 3), or a task of
            ``task_path``, as ``plan`` takes it; None is that of a plan.
        q: The motion, (N + 1, nv), a configuration for each sample of the path; or where the arm starts, as
            ``plan`` takes it, (nv,): it then moves its joints least; or a plan [rad or m].
        dt: The time between samples of poses or points, > 0 [s], which must be given for them; a path of
            ``ftqp.paths`` has as many samples as the motion, and from a start 400 if none is given.
        stride: Every so many samples are verified, >= 1. A larger one is faster and coarser.
        lock: ``instant``, or ``ramp``: the joint brakes with its deceleration while the rest go on.
        post: How the rest go on: ``exact`` follows the path with as many joints as rows, ``qp`` takes one
            bounded QP a sample, and ``planner`` drives an ``ftqp.Planner`` in closed loop, which takes some
            tenths of a second an instant. None is ``exact`` where it is possible, else ``qp``.
        rows: What of the task is to be kept after a failure; None is all of it. ``"position"`` gives rotation
            up, ``"position_axis"`` the turn about the tool.
        joints: Which joints fail, by name or index, sets of two for joints that fail together, or ``"pairs"``
            for all sets of two; None is each alone.
        fault: ``locked``, ``degraded``: the joint goes on with a share of its speed, or ``free_swinging``: it
            has no torque, and the planner goes on.
        velocity: The share of the speed limit that a degraded joint has left, in (0, 1].
        deceleration: Of a ramp, (nv,) or one number, > 0 [rad/s2 or m/s2]; None is a quarter of the limit.
        tolerance: Errors of position and rotation within which ``qp`` survives a pair, > 0 [m, rad].
        upper_bound: At how many samples it is looked how many joints any posture can do without; None does
            not look, for it takes some tenths of a second each.
        scene: What stands around the arm, as it stands now. A failure after which the arm comes nearer to it,
            or to itself, than is to be kept is not survived; ``qp`` and ``planner`` go round as far as the
            joints that are left can, ``exact`` has no choice. None is that of the path, or nothing.
        clearance: How far the arm keeps; None is ``ftqp.Clearance()`` with a scene.
        threads: How many threads share the work; None is one a core.
        task: Of a robot with several tips, the frame that follows the path, by its name; None is its first
            tip. Joints off the way to it do not matter to this task, and are left out of the report;
            what the failure does to other tasks is not looked at.
        verified: Follows all pairs of the case that it is given and makes its report, as ``ftqp coverage``
            does with many processes; None does it here.

    Raises:
        InputError: The motion does not follow the path, is not finite or has a wrong shape, the path belongs
            to another robot, a setting is out of its range, or something in the scene moves.
    """
    instance("robot", robot, Robot, "a Robot")
    whole_number("stride", stride, 1)
    if task is not None or not (robot.is_serial or isinstance(q, MotionOnPath)):
        frame = robot.tip if task is None else task
        robot, q = robot.arm_to(frame), on_way(robot, frame, q)
    if isinstance(q, MotionOnPath):
        own = q.of(robot, path)
        path, q = own.task, own.q
    way = _task(robot, path, q, dt, scene=scene, clearance=clearance)
    q = track(way, q) if np.ndim(q) == 1 else q
    motion = frozen(array("q", q, (way.N + 1, robot.nv), "(N + 1, nv)"))
    if lock not in ("instant", "ramp"):
        raise InputError(f"lock is {lock!r}, expected 'instant' or 'ramp'")
    if fault not in FAULTS:
        raise InputError(f"fault is {fault!r}, expected one of {', '.join(FAULTS)}")
    if not 0.0 < positive("velocity", velocity) <= 1.0:
        raise InputError(f"velocity is {velocity:g}, expected a share of the speed limit in (0, 1]")
    limits = tuple(positive("tolerance", value) for value in array("tolerance", tolerance, (2,)))
    J = _refuse_off_path(way, motion)
    kept = way if rows is None else way.with_rows(rows)
    failures = _failures(robot, joints)
    rule = _rule(robot, kept, post, failures, fault)
    if fault == "free_swinging":
        refuse_no_masses(robot)
    bound = None
    if upper_bound is not None:
        whole_number("upper_bound", upper_bound, 1)
        bound = bound_of(kept, upper_bound)
    reports: tuple[kinds.Fault, ...] = ()
    if rule == "planner":
        reports = tuple(
            _belief_of(robot.joints[one[0]], fault, lock, velocity, deceleration) for one in failures
        )
    case = CoverageCase(
        pairs=Pairs(
            task=kept,
            q=motion,
            samples=frozen(np.arange(0, way.N, stride)),
            failures=failures,
            speeds=_speeds(robot, motion, way.dt, lock, deceleration),
            rule=rule,
            share=float(velocity) if _is_slower(fault) else None,
            reports=reports,
            deceleration=None if deceleration is None else _decelerations(robot, deceleration),
            tolerance=(limits[0], limits[1]),
        ),
        bound=bound,
        manipulability=_manipulability(J if rows is None else path_values(kept, motion)[1], failures),
        fault=fault,
        lock=lock,
    )
    return case.verify(threads) if verified is None else verified(case)


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CoverageCase:
    """What is to be verified, checked."""

    pairs: Pairs  # The pairs of failure and instant
    bound: Bound | None  # What any posture can do without; None where that is not asked for
    manipulability: FloatArray  # Relative manipulability without each failure's joints, (N + 1, failures)
    fault: Fault  # How joints fail
    lock: str  # ``instant`` or ``ramp``

    def verify(self, threads: int | None = None) -> CoverageReport:
        """The report, with every pair followed here and now."""
        found, bound = self.pairs.runs(range(self.pairs.count), threads), self.bound
        return self.report(found, None if bound is None else bound.counts(range(len(bound.samples)), threads))

    def report(self, found: Continuations, most: IntArray | None) -> CoverageReport:
        """The report."""
        pairs, robot = self.pairs, self.pairs.task.robot
        K, F = len(pairs.samples), len(pairs.failures)
        kept, motion = pairs.task, pairs.q
        structural: tuple[str, ...] = ()
        if self.fault == "locked":
            structural = structural_joints(robot, kept.named_rows)
        column, row = np.divmod(np.arange(pairs.count), F)
        at = pairs.samples[column]
        status = _verdicts(robot, motion, at, found.status, row, pairs.failures, structural)

        def by_failure(values: Any) -> Any:
            return frozen(np.ascontiguousarray(np.reshape(values, (K, F)).T))

        bound = self.bound
        return CoverageReport(
            task=kept,
            q=motion,
            samples=pairs.samples,
            failures=pairs.failures,
            status=by_failure(status),
            position=by_failure(found.position),
            rotation=by_failure(found.rotation),
            margin=by_failure(found.margin),
            hurry=by_failure(found.hurry),
            clearance=by_failure(found.clearance),
            jump=frozen(_jumps(motion, kept.dt, pairs.samples, pairs.failures, self.manipulability)),
            manipulability=frozen(self.manipulability),
            structural=structural,
            upper_bound=most,
            waypoints=np.zeros(0, np.int64) if bound is None else bound.samples * bound.stride,
            fault=self.fault,
            lock=self.lock,
            post=pairs.rule,
            tolerance=pairs.tolerance,
            _pairs=pairs,
        )


def _task(robot: Robot, path: Any, q: Any, dt: float | None, **around: Any) -> TaskPath:
    """The path on the grid of the motion."""
    if isinstance(path, TaskPath):
        return task_path(robot, path, **around)
    if np.ndim(q) == 1 and isinstance(path, Path):
        return task_path(robot, path, dt=dt, q0=q, **around)
    count = np.shape(q)[0] if np.ndim(q) == 2 else 0
    if count < 2 and np.ndim(q) != 1:
        raise InputError(
            f"q has shape {np.shape(q)}, expected a motion, (N + 1, nv) with at least 2 samples, or where it "
            f"starts, (nv,) = ({robot.nv},)"
        )
    if isinstance(path, Path):
        return task_path(robot, path, dt=path.duration / (count - 1), **around)
    if path is None:
        raise InputError("path is None, which stands for that of a plan; give the path of this motion")
    rows = "pose" if np.ndim(path) == 3 else "position"
    return task_path(robot, path, rows=rows, dt=dt, **around)


def _refuse_off_path(task: TaskPath, q: FloatArray) -> FloatArray:
    """Refuses a motion that is not where the path is; returns its Jacobians, (N + 1, m, nv)."""
    e, J = path_values(task, q)
    turning = np.array([index > 2 for index in task.indices])
    off = np.linalg.norm(e[:, ~turning], axis=1), np.linalg.norm(e[:, turning], axis=1)
    for error, tolerance, unit in zip(off, FOLLOWED, ("m", "rad"), strict=True):
        if error.max(initial=0.0) > tolerance:
            k = int(np.argmax(error > tolerance))
            raise InputError(
                f"q does not follow the path: at sample {k} (t = {task.t[k]:.4g} s) the end effector is "
                f"{error[k]:.3g} {unit} off, expected at most {tolerance:g} {unit}; track the path first"
            )
    return J


def _failures(robot: Robot, joints: Any) -> tuple[tuple[int, ...], ...]:
    """Sets of joints that fail together, all of one size."""
    if joints is None:
        return tuple((i,) for i in range(robot.nv))
    if isinstance(joints, str) and joints == "pairs":
        return tuple(combinations(range(robot.nv), 2))
    if isinstance(joints, str | int):
        return ((robot.joint(joints),),)
    found = []
    for one in joints:
        given: Sequence[Any] = (one,) if isinstance(one, str | int | np.integer) else tuple(one)
        found.append(tuple(robot.joint(joint) for joint in given))
    if (
        not found
        or {len(failed) for failed in found} not in ({1}, {2})
        or any(len(set(f)) != len(f) for f in found)
    ):
        raise InputError(f"joints are {joints!r:.80}, expected joints, or sets of two different ones")
    return tuple(found)


def _rule(
    robot: Robot, task: TaskPath, post: Any, failures: tuple[tuple[int, ...], ...], fault: str
) -> Literal["exact", "qp", "planner"]:
    """How the other joints go on."""
    if post not in (None, "exact", "qp", "planner"):
        raise InputError(f"post is {post!r}, expected 'exact', 'qp', 'planner' or None")
    slower = _is_slower(fault)
    if post == "planner" or not (slower or fault == "locked"):
        if post not in (None, "planner") or len(failures[0]) > 1:
            raise InputError(
                "the planner goes on after one failure at a time, and always after one that is no lock "
                "and no loss of speed, as of a free-swinging joint; leave post out, and give single joints"
            )
        return "planner"
    left = robot.nv - (0 if slower else len(failures[0]))
    if post == "exact" and left != task.m:
        raise InputError(
            f"post is 'exact' and {left} joints are left for {task.m} rows; expected as many, or post='qp'"
        )
    return "exact" if left == task.m and post != "qp" else "qp"


def _is_slower(fault: str) -> bool:
    """Whether joints with that kind of fault go on with a share of their speed."""
    kind = kinds.KINDS[fault]
    return kind.works and "v_max" in kind.shares


def _belief_of(joint: str, fault: Fault, lock: str, velocity: float, brakes: Any) -> kinds.Fault:
    """What is reported to the planner of a joint."""
    match fault:
        case "free_swinging":
            return kinds.FreeSwinging(joint)
        case "degraded":
            return kinds.Degraded(joint, velocity=velocity)
        case "locked" if lock == "instant":
            return kinds.Locked(joint, mode="instant", reset="task")
    if brakes is not None and np.ndim(brakes) > 0:
        raise InputError("deceleration has one number a joint, and a planner takes one for all; give that")
    return kinds.Locked(joint, deceleration=brakes)


def _decelerations(robot: Robot, deceleration: Any) -> FloatArray:
    try:
        found = np.broadcast_to(np.asarray(deceleration, dtype=np.float64), (robot.nv,))
    except ValueError as error:
        raise InputError(
            f"deceleration has shape {np.shape(deceleration)}, expected one number or (nv,) = ({robot.nv},)"
        ) from error
    if not (found > 0.0).all():
        raise InputError("deceleration is not positive, expected > 0 [rad/s2 or m/s2]")
    return np.asarray(found)


def _speeds(robot: Robot, q: FloatArray, dt: float, lock: str, deceleration: Any) -> FloatArray:
    """With which speed each joint begins to brake at each sample, (N + 1, nv); 0 where it locks at once."""
    if lock == "instant":
        return np.zeros_like(q)
    brakes = robot.limits.a_max if deceleration is None else _decelerations(robot, deceleration)
    return np.where(np.isfinite(brakes), np.gradient(q, dt, axis=0), 0.0)


def _verdicts(
    robot: Robot,
    q: FloatArray,
    instant: IntArray,
    status: IntArray,
    which: IntArray,
    failures: tuple[tuple[int, ...], ...],
    structural: tuple[str, ...],
) -> IntArray:
    """Statuses with those of structural joints, and of instants at which the motion is outside its limits."""
    missing = {robot.joint(name) for name in structural}
    never = np.array([bool(missing & set(failed)) for failed in failures])[which]
    limits, at = robot.limits, q[instant]
    outside = ((at < limits.q_min - 1e-9) | (at > limits.q_max + 1e-9)).any(axis=1)
    found = np.where(never & (status != Survival.SURVIVED), int(Survival.STRUCTURAL), status)
    return np.where(outside, int(Survival.NOMINAL), found)


def _manipulability(J: FloatArray, failures: tuple[tuple[int, ...], ...]) -> FloatArray:
    """Relative manipulability without each failure's joints, (N + 1, failures), signed where known."""
    if J.shape[2] - J.shape[1] == 1 and len(failures[0]) == 1:
        return null_vector(J)[:, [failed[0] for failed in failures]]
    return relative_manipulability(J, failures)


def _jumps(
    q: FloatArray, dt: float, samples: IntArray, failures: tuple[tuple[int, ...], ...], n: FloatArray
) -> FloatArray:
    """|v_j|/|n_j| of each failure at each instant, (failures, K) [rad/s]; of two joints NaN."""
    if len(failures[0]) > 1:
        return np.full((len(failures), len(samples)), np.nan)
    v = np.abs(np.gradient(q, dt, axis=0))[samples][:, [failed[0] for failed in failures]]
    share = np.abs(n[samples])
    with np.errstate(divide="ignore", invalid="ignore"):
        jump = np.where(v > 0.0, np.where(share > LOST, v / share, np.inf), 0.0)
    return np.asarray(jump.T)
