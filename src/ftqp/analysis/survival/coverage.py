"""Which failures a motion survives: every joint, at every instant of a path."""

from typing import Any, Literal

from ftqp.analysis.planning.fault_plan import Plan
from ftqp.analysis.survival.coverage_case import FOLLOWED, Fault, coverage_case
from ftqp.analysis.survival.coverage_report import CoverageReport
from ftqp.control.scene.keeping_clear import Clearance
from ftqp.control.scene.placed_shapes import Scene
from ftqp.core.checks import instance
from ftqp.model.frames import on_way
from ftqp.model.robot import Robot


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
        scene: What stands around the arm, as it stands now. A failure after which the arm comes nearer to it,
            or to itself, than is to be kept is not survived; ``qp`` and ``planner`` go round as far as the
            joints that are left can, ``exact`` has no choice. None is that of the path, or nothing.
        clearance: How far the arm keeps; None is ``ftqp.Clearance()`` beside a scene.
        threads: How many threads share the work; None is one a core.
        task: Of a robot with several tips, the frame that follows the path, by its name; None is its first
            tip. Joints beside the way to it do not matter to this task, and are left out of the report;
            what the failure does to other tasks is not looked at.

    Raises:
        InputError: The motion does not follow the path, is not finite or has a wrong shape, the path belongs
            to another robot, a setting is out of its range, or something in the scene
            moves.
    """
    instance("robot", robot, Robot, "a Robot")
    if task is not None or not (robot.is_serial or isinstance(q, Plan)):
        frame = robot.tip if task is None else task
        robot, q = robot.arm_to(frame), on_way(robot, frame, q)
    if isinstance(q, Plan):
        own = q.of(robot, path)
        path, q = own.task, own.q
    case = coverage_case(
        robot, path, q, dt=dt, stride=stride, lock=lock, post=post, rows=rows, joints=joints, fault=fault,
        velocity=velocity, deceleration=deceleration, tolerance=tolerance, upper_bound=upper_bound,
        scene=scene, clearance=clearance,
    )  # fmt: skip
    return case.verify(threads)
