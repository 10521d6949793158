"""What the checker is shown of a simulated run: the truth from the log, the limits from the arm's file."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ftqp.app.scenario.setup import Setup
from ftqp.checker.model_file import ModelFile, link_shapes
from ftqp.checker.trace import Body, Cone, Failure, HeldTask, Plane, Thing, Trace
from ftqp.control.following.path_follower import PathFollower
from ftqp.control.planner.status import STATUSES
from ftqp.control.task.soft_tasks import SETS
from ftqp.control.task.task import ROW_SETS
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.urdf_text import link_names
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.signals import HEALTHY
from ftqp.sim.plants.kinematic_plant import BRAKE_SHARE
from ftqp.sim.plants.true_arm import TrueArm

PATH_PERIOD = 0.01
"""A path that waits for its arm is shown at about so many seconds of its own time, as often as the checker
looks for motions."""


def trace(setup: Setup, log: Log) -> Trace:
    """What is shown of a run; its last row is the state at which the last judged tick ends."""
    if setup.world is not None:
        raise InputError("the base moves, which the checker does not judge; leave [base] out of a campaign")
    q, v, task = log["q"], log["v"], setup.planner.task
    rows = ROW_SETS[task.rows] if isinstance(task.rows, str) else task.rows or setup.robot.default_rows
    has_commands = "q_command" in {name.split(".", 1)[0] for name in log.names}
    sent_q, sent_v = (log["q_command"], log["v_command"]) if has_commands else _sent(setup, log)
    return Trace(
        dt=setup.planner.dt,
        level=setup.planner.level,
        q=q,
        v=v,
        sent_q=sent_q[:-1],
        sent_v=sent_v[:-1],
        status=[STATUSES[int(code)].name for code in log["status"][:-1]],
        target=_poses(log["target"][:-1]),
        rows=rows,
        axis=task.axis if task.rows == "position_axis" else None,
        tolerance=(task.tolerance, task.rotation_tolerance),
        failures=failures(setup),
        planes=planes(log),
        minds_torques=setup.tables.planner.torque_limits,
        brakes=_true_arm(setup) is not None,
        cones=cones(log),
        held=held(log),
        bodies=bodies(log),
        things=things(log),
        watched=[(first, second) for first, second in log.metadata.get("watched", [])],
        keep=log.metadata.get("clearance", {}).get("keep", 0.0),
        holds=[(one["at"], one["at"] + one["duration"]) for one in setup.tables.simulation.holds],
        blamed=log["belief"][:-1] != HEALTHY,
        **_waiting_path(setup, log),
    )


def _waiting_path(setup: Setup, log: Log) -> dict[str, Any]:
    """The path of a run that goes along it by its progress; nothing of one that the clock leads."""
    path = setup.path
    if not isinstance(setup.follower, PathFollower) or not np.isfinite(path.duration):
        return {}
    times = np.linspace(0.0, path.duration, max(2, round(path.duration / PATH_PERIOD)))
    return {
        "path": path.sample(times).pose,
        "path_dt": float(times[1]),
        "progress": np.nan_to_num(log["progress"][:-1]),
    }


def bodies(log: Log) -> list[Body]:
    """The links that were to be kept clear, as the log has them."""
    index = {name: k for k, name in enumerate(log.metadata["joints"])} | {None: -1}
    return [
        Body(
            name=one["name"],
            joint=index[one["joint"]],
            ends_at_zero=one["ends_at_zero"],
            radius=one["radius"],
            corners_at_zero=np.array(one.get("corners_at_zero", np.zeros((0, 3)))),
        )
        for one in log.metadata.get("bodies", [])
    ]


def things(log: Log) -> list[Thing]:
    """What stands around the arm, as the log has it."""
    return [
        Thing(
            name=one["name"],
            kind=one["kind"],
            extent=one["extent"],
            pose=np.array(one["pose"]),
            corners=np.array(one.get("corners", np.zeros((0, 3)))),
        )
        for one in log.metadata.get("scene", [])
        if one["kind"] != "arm"
    ]


def planes(log: Log) -> list[Plane]:
    """The planes, and sides of boxes, on whose sides points were to stay, as the log has them."""
    joints = list(log.metadata["joints"])
    found = []
    for one in log.metadata.get("constraints", []):
        sides: list[tuple[Any, float]] = []
        if one["kind"] == "plane":
            sides = [(one["normal"], float(np.dot(one["normal"], one["above"])))]
        elif one["kind"] == "box":
            sides = [
                ((sign * np.eye(3)[k]).tolist(), sign * place)
                for sign, corner in zip((1.0, -1.0), one["inside"], strict=True)
                for k, place in enumerate(corner)
                if place is not None
            ]
        joint = joints.index(one["joint"]) if sides else 0
        found += [
            Plane(joint=joint, at_zero=one["at_zero"], normal=normal, offset=offset)
            for normal, offset in sides
        ]
    return found


def cones(log: Log) -> list[Cone]:
    """The cones in which axes were to stay, as the log has them."""
    joints = list(log.metadata["joints"])
    return [
        Cone(
            joint=joints.index(one["joint"]),
            at_zero=one["at_zero"],
            axis_at_zero=one["axis_at_zero"],
            along=one["along"],
            within=one["within"],
        )
        for one in log.metadata.get("constraints", [])
        if one["kind"] == "cone"
    ]


def held(log: Log) -> list[HeldTask]:
    """The tasks that go before that of the tip, as the log has them; rows of the user's own are not known."""
    index = {name: k for k, name in enumerate(log.metadata["joints"])} | {None: -1}
    return [
        HeldTask(
            name=one["name"],
            kind=one["kind"],
            rows=_rows(one.get("rows", "pose")),
            joint=index[one.get("joint")],
            at_zero=np.array(one.get("at_zero", np.eye(4))),
            target=np.array(one["goal"]),
            axis=np.array(one["axis"]) if "axis" in one else None,
            towards="towards" in one,
            other=index[one.get("other_joint")],
            other_at_zero=np.array(one["other_at_zero"]) if "other_at_zero" in one else None,
        )
        for one in log.metadata.get("tasks", [])
        if "goal" in one and one["weight"] > 0.0
    ]


def _rows(rows: str | list[str]) -> Sequence[str]:
    """Names of rows, of a word for some, of letters or of names."""
    if not isinstance(rows, str) or rows not in SETS:
        return tuple(rows)
    return [name for k, name in enumerate(COMPONENTS) if SETS[rows] >> k & 1]


def failures(setup: Setup) -> list[Failure]:
    """What really fails in a run."""
    events = sorted(setup.schedule, key=lambda event: event.at)
    true, result = _true_arm(setup), []
    for k, event in enumerate(events):
        joint, fault = setup.robot.joint(event.fault.joint), event.fault
        later = [other.at for other in events[k + 1 :] if setup.robot.joint(other.fault.joint) == joint]
        jumps = getattr(fault, "mode", "") == "instant"
        result.append(
            Failure(
                joint=joint,
                kind=fault.judged,
                since=event.at,
                reported_at=np.inf if event.reported_at is None else event.reported_at,
                shares={limit: getattr(fault, share) for limit, share in fault.shares.items()},
                jumps=jumps,
                until=later[0] if later else np.inf,
                deceleration=np.inf if jumps else _deceleration(setup, joint, fault),
                closes=0.0 if true is None or jumps else true.brake_delay,
                slips=true is not None and not jumps and _slips(setup, true, joint),
            )
        )
    return result


def _true_arm(setup: Setup) -> TrueArm | None:
    """What is true of the arm; None of one that is as its planner knows it."""
    simulation = setup.tables.simulation
    return simulation.mujoco.true_arm() if simulation.plant == "mujoco" else None


def _slips(setup: Setup, true: TrueArm, joint: int) -> bool:
    """Whether a brake may be too weak: one that holds less than the motor gives."""
    robot = setup.robot
    holds = (true.brake or {}).get(robot.joints[joint], np.inf)
    return bool(holds < robot.limits.tau_max[joint])


def _deceleration(setup: Setup, joint: int, fault: object) -> float:
    """With which a planner brings its command for a joint to rest after the report of a fault."""
    own = getattr(fault, "deceleration", None)
    return float(BRAKE_SHARE * setup.robot.limits.a_max[joint] if own is None else own)


def model_file(setup: Setup) -> ModelFile:
    """The arm as the checker reads it, from its URDF, with its true masses, rotors and friction."""
    robot = setup.robot
    tip = link_names(robot.joints, robot.tips)[robot.nv + 1]
    if (true := _true_arm(setup)) is not None:
        dry, viscous = true.friction(robot)
        robot = replace(robot, chain=replace(true.chain(robot), viscous=viscous, coulomb=dry))
    found = ModelFile.read(robot.to_urdf(), tip, gravity=robot.chain.gravity)
    if found.names != robot.joints:
        raise InputError(
            f"the checker reads the joints of {robot.name} in another order, {', '.join(found.names)}; name "
            "those of its arms so that they sort as they stand"
        )
    urdf = setup.tables.robot.urdf
    if urdf is not None and setup.planner.scene is not None:
        found = replace(found, links=link_shapes(setup.folder / urdf, robot.joints))
    return found


def _sent(setup: Setup, log: Log) -> tuple[FloatArray, FloatArray]:
    """The command for the end of each tick where the log leaves it out: it was integrated and obeyed.

    A joint that failed before the planner knew does not obey, and its command goes on from where the planner
    takes it to be. What was sent to it is not in the log, and what it did takes that place.
    """
    dt, half = setup.planner.dt, 0.5 if setup.planner.level == "acceleration" else 1.0
    q, v, a = log["q"], log["v"], log["a"].copy()
    t = dt * np.arange(len(q))
    for failure in failures(setup):
        if failure.reported_at > failure.since:
            unknown = (t >= failure.since - 0.5 * dt) & (t < failure.until)
            a[unknown, failure.joint] = (np.diff(v[:, failure.joint], append=v[-1, failure.joint]) / dt)[
                unknown
            ]
    return q + dt * (v + half * dt * a), v + dt * a


def _poses(target: FloatArray) -> FloatArray:
    """Homogeneous transforms (K, 4, 4) of positions and unit quaternions x, y, z, w, (K, 7)."""
    x, y, z, w = target[:, 3:].T
    result = np.zeros((len(target), 4, 4))
    result[:, 0, :3] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], axis=1)
    result[:, 1, :3] = np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], axis=1)
    result[:, 2, :3] = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=1)
    result[:, :3, 3], result[:, 3, 3] = target[:, :3], 1.0
    return result
