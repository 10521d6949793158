"""Which failures a motion survives: every joint, at every instant of a path."""

from collections.abc import Sequence
from itertools import combinations
from typing import Any, Literal, get_args

import numpy as np

from ftqp.analysis.planning.fault_plan import Plan
from ftqp.analysis.spatial_map import whole_number
from ftqp.analysis.survival.continuing import continuation_study, path_values
from ftqp.analysis.survival.coverage_report import CoverageReport
from ftqp.analysis.survival.planner_runs import planner_runs
from ftqp.analysis.survival.task_path import TaskPath, task_path
from ftqp.analysis.survival.tolerable_joints import tolerable_joints
from ftqp.analysis.tolerance.failed_sets import relative_manipulability
from ftqp.analysis.tolerance.null_vectors import null_vector
from ftqp.analysis.tolerance.structural_joints import structural_joints
from ftqp.control.paths import Path
from ftqp.core.checks import FloatArray, IntArray, array, frozen, instance, positive
from ftqp.core.errors import InputError
from ftqp.faults import kinds
from ftqp.kernel.layout.survival import Survival
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
    threads: int | None = None,
) -> CoverageReport:
    """Which failures a motion survives: each (joint, instant) is continued to the end of the path.

    Source: zhang2016, section 2.1; paredis1996; docs/theory/coverage.md.

    Args:
        robot: The arm.
        path: The path, a ``TaskPath`` or a path of ``ftqp.paths``; None is that of a plan.
        q: The motion, (N + 1, nv), a configuration for each sample of the path, or a plan [rad or m].
        stride: Every so many samples are verified, >= 1. A larger one is faster and coarser.
        lock: ``instant``, or ``ramp``: the joint brakes with its deceleration while the others go on.
        post: How the others go on: ``exact`` follows the path with as many joints as rows, ``qp`` takes one
            bounded QP a sample, and ``planner`` drives an ``ftqp.Planner`` in closed loop, which takes some
            tenths of a second an instant. None is ``exact`` where it is possible, else ``qp``.
        rows: What of the task is to be kept after a failure; None is all of it. ``"position"`` gives rotation
            up, ``"position_axis"`` the turn about the tool.
        joints: Which joints fail, by name or index, sets of two for joints that fail together, or ``"pairs"``
            for all sets of two; None is each alone.
        fault: ``locked``, ``degraded``: the joint goes on with a share of its speed, or ``free_swinging``: it
            has no torque, and the planner goes on.
        velocity: The share of the speed limit that a degraded joint has left, in (0, 1].
        deceleration: Of a ramp, (nv,) or one number, > 0 [rad/s2 or m/s2]; None is a quarter of each joint's
            acceleration limit.
        tolerance: Errors of position and rotation within which a pair counts as survived with ``qp``, > 0
            [m, rad].
        upper_bound: At how many samples it is looked how many joints any posture can do without; None does
            not look, for it takes some tenths of a second each.
        threads: How many threads share the work; None is one a core.

    Raises:
        InputError: The motion does not follow the path, is not finite or has a wrong shape, the path belongs
            to another robot, or a setting is out of its range.
    """
    instance("robot", robot, Robot, "a Robot")
    whole_number("stride", stride, 1)
    if isinstance(q, Plan):
        own = q.of(robot, path)
        path, q = own.task, own.q
    task = _task(robot, path, q)
    motion = frozen(array("q", q, (task.N + 1, robot.nv), "(N + 1, nv)"))
    if lock not in ("instant", "ramp"):
        raise InputError(f"lock is {lock!r}, expected 'instant' or 'ramp'")
    if fault not in FAULTS:
        raise InputError(f"fault is {fault!r}, expected one of {', '.join(FAULTS)}")
    if not 0.0 < positive("velocity", velocity) <= 1.0:
        raise InputError(f"velocity is {velocity:g}, expected a share of the speed limit in (0, 1]")
    limits = tuple(positive("tolerance", value) for value in array("tolerance", tolerance, (2,)))
    J = _refuse_off_path(task, motion)
    kept = task if rows is None else task.with_rows(rows)
    failures = _failures(robot, joints)
    rule = _rule(robot, kept, post, failures, fault)
    study = continuation_study(
        kept,
        deceleration=None if deceleration is None else _decelerations(robot, deceleration),
        tolerance=(limits[0], limits[1]),
    )
    samples = np.arange(0, task.N, stride)
    speeds = _speeds(robot, motion, task.dt, lock, deceleration)
    failed = np.array(failures, dtype=np.int64)
    which, instant = (a.ravel() for a in np.meshgrid(np.arange(len(failures)), samples, indexing="ij"))
    share = float(velocity) if fault == "degraded" else None
    if rule == "planner":
        told = [_told(robot.joints[failed[0]], fault, lock, velocity, deceleration) for failed in failures]
        found = planner_runs(kept, motion, samples, told, (limits[0], limits[1]), threads)
    else:
        found = study.runs(
            motion[instant],
            instant,
            failed[which],
            speed=np.take_along_axis(speeds[instant], failed[which], axis=1),
            bounded=rule == "qp",
            share=share,
            threads=threads,
        )
    shape = (len(failures), len(samples))
    structural = (
        structural_joints(robot, "position_axis" if kept.axis else kept.rows) if fault == "locked" else ()
    )
    status = _verdicts(robot, motion, instant, found.status, which, failures, structural).reshape(shape)
    waypoints = np.zeros(0, np.int64)
    most = None
    if upper_bound is not None:
        whole_number("upper_bound", upper_bound, 1)
        waypoints, most = tolerable_joints(kept, upper_bound, threads=threads)
    manipulability = _manipulability(J if rows is None else path_values(kept, motion)[1], failures)
    return CoverageReport(
        task=kept,
        q=motion,
        samples=frozen(samples),
        failures=failures,
        status=frozen(status),
        position=frozen(found.position.reshape(shape)),
        rotation=frozen(found.rotation.reshape(shape)),
        margin=frozen(found.margin.reshape(shape)),
        hurry=frozen(found.hurry.reshape(shape)),
        jump=frozen(_jumps(motion, task.dt, samples, failures, manipulability)),
        manipulability=frozen(manipulability),
        structural=structural,
        upper_bound=most,
        waypoints=waypoints,
        fault=fault,
        lock=lock,
        post=rule,
        tolerance=(limits[0], limits[1]),
        _study=study,
        _share=share,
        _speeds=speeds,
    )


def _task(robot: Robot, path: Any, q: Any) -> TaskPath:
    """The path on the grid of the motion."""
    if isinstance(path, TaskPath):
        if path.robot is not robot and path.digest != path.with_robot(robot).digest:
            raise InputError(
                f"path was made for another robot than {robot.name}, or for one with another tool, load or "
                "limits; expected the same arm"
            )
        return path
    count = np.shape(q)[0] if np.ndim(q) == 2 else 0
    if count < 2:
        raise InputError(f"q has shape {np.shape(q)}, expected (N + 1, nv) with at least 2 samples")
    if isinstance(path, Path):
        return task_path(robot, path, dt=path.duration / (count - 1))
    raise InputError(f"path is of type {type(path).__name__}, expected a TaskPath or a path of ftqp.paths")


def _refuse_off_path(task: TaskPath, q: FloatArray) -> FloatArray:
    """Refuses a motion that is not where the path is; returns its Jacobians, (N + 1, m, nv)."""
    e, J = path_values(task, q)
    turning = np.array([index > 2 for index in task.indices])
    off = np.linalg.norm(e[:, ~turning], axis=1), np.linalg.norm(e[:, turning], axis=1)
    for error, tolerance, unit in zip(off, FOLLOWED, ("m", "rad"), strict=True):
        if error.max(initial=0.0) > tolerance:
            k = int(np.argmax(error > tolerance))
            raise InputError(
                f"q does not follow the path: at sample {k} (t = {task.t[k]:.4g} s) the tip is "
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
    if post == "planner" or fault == "free_swinging":
        if post not in (None, "planner") or len(failures[0]) > 1:
            raise InputError(
                "the planner goes on after one failure at a time, and always after that of a free-swinging "
                "joint; leave post out, and give single joints"
            )
        return "planner"
    left = robot.nv - (len(failures[0]) if fault == "locked" else 0)
    if post == "exact" and left != task.m:
        raise InputError(
            f"post is 'exact' and {left} joints are left for {task.m} rows; expected as many, or post='qp'"
        )
    return "exact" if left == task.m and post != "qp" else "qp"


def _told(
    joint: str, fault: str, lock: Literal["instant", "ramp"], velocity: float, brakes: Any
) -> kinds.Fault:
    """What the planner is told of a joint."""
    if fault == "free_swinging":
        return kinds.FreeSwinging(joint)
    if fault == "degraded":
        return kinds.Degraded(joint, velocity=velocity)
    if lock == "instant":
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
