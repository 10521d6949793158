"""The arms of the catalog, each put together from its figures: those of its file, or made up."""

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray, positive
from ftqp.core.errors import InputError
from ftqp.kernel.layout.enums import JOINTS
from ftqp.model.audit import note
from ftqp.model.build import ROWS
from ftqp.model.capsules import Capsule
from ftqp.model.limits import JointLimits, joined
from ftqp.model.robot import Robot
from ftqp.model.serial import EARTH, Body, Inertial, graft, placement, serial_model, symmetric

LEANS = {"x": (0.0, 90.0, 0.0), "y": (-90.0, 0.0, 0.0), "-y": (90.0, 0.0, 0.0), "z": (0.0, 0.0, 0.0)}
"""Roll, pitch, yaw [deg] that turn a z axis, about which a joint turns, into an axis of the stretched arm."""

LONGEST = 1e6
"""A link of a made-up arm is no longer [m]."""
REACH = 1.5
"""Length of a stretched planar arm [m]."""
DENSITY = 4.0
"""Mass per length of uniform slender links [kg/m]."""
FLAT, DOWN = (0.0, 0.0, 0.0), (0.0, -9.81, 0.0)
"""Gravity [m/s2] of a planar arm in a horizontal plane, and in a vertical one."""
BEND = float(np.deg2rad(150.0))
"""How far a joint of a planar arm with limits turns either way [rad]."""
COUNT = 4
"""Joints of a planar arm for which nothing is said."""

SIDES = (("left", 0.5), ("right", -0.5))
"""Two arms on one base, and where each stands along y, in their distance."""


def arm(
    name: str,
    joints: Sequence[str],
    placements: Sequence[FloatArray],
    inertials: Sequence[Inertial] | None,
    limits: Mapping[str, Any],
    *,
    tip: str,
    tip_pose: FloatArray,
    payload: Sequence[tuple[FloatArray, Inertial]] = (),
    neutral: Any = None,
    default_rows: Sequence[str] = ROWS,
    length: float | None = None,
    gravity: Sequence[float] = EARTH,
    rotors: float = 0.0,
    continuous: bool = False,
    capsules: Sequence[Capsule] = (),
) -> Robot:
    """A robot of revolute joints about their z axes, from the figures that ``published`` names.

    ``placements`` are each joint's frame in that of the one before at q = 0, and ``payload`` rigid bodies
    behind the last joint, each with its frame's pose (4, 4) there.
    """
    bodies = []
    for i, (joint, place) in enumerate(zip(joints, placements, strict=True)):
        parts = [] if inertials is None else [(np.eye(4), inertials[i])]
        parts += payload if i == len(joints) - 1 else []
        bodies.append(Body(name=joint, placement=place, continuous=continuous, parts=parts))
    written = JointLimits.of(len(joints), **limits)
    model = serial_model(name, bodies, written, frames=[(tip, tip_pose)], gravity=gravity)
    model.armature = np.full(model.nv, rotors)
    made = Robot.from_pinocchio(
        model, tip, limits=limits, neutral=neutral, default_rows=default_rows, length=length
    )
    return made.with_capsules(capsules) if capsules else made


def published(name: str) -> dict[str, Any]:
    """The figures of the file of an arm; those in degrees, ``..._deg``, in radians.

    Joints stand in one of three ways: ``origins``, x, y, z [m] and roll, pitch, yaw of each in the one
    before; ``stretched``, the axis of each and its place after the one before [m], in axes of the arm at
    q = 0; ``dh``, rows (theta, d, a, alpha) of a standard table. ``tip_place`` is the tip's place after the
    last joint [m], in the same axes. ``inertials`` are rows of mass, centre of mass and ixx, ixy, ixz, iyy,
    iyz, izz about it, and ``capsules`` rows of name, frame, both ends and radius [m].
    """
    with (Path(__file__).parent / f"{name}.toml").open("rb") as file:
        figures = tomllib.load(file)
    figures |= {"limits": _radians(figures["limits"])}
    for row in figures.get("dh", ()):
        row[0], row[3] = np.deg2rad([row[0], row[3]]).tolist()
    return _radians(figures)


def _radians(table: Mapping[str, Any]) -> dict[str, Any]:
    return {
        key.removesuffix("_deg"): np.deg2rad(value).tolist() if key.endswith("_deg") else value
        for key, value in table.items()
    }


def arm_of_file(name: str, **changes: Any) -> Robot:
    """The arm of a file, with some arguments of ``arm`` in place of what the file says."""
    figures = published(name)
    names, rows = figures.get("joints", ""), figures.get("origins", figures.get("stretched", ()))
    shared: dict[str, Any] = {
        key: figures[key] for key in ("neutral", "length", "gravity", "rotors") if key in figures
    }
    end = placement(figures.get("tip_place", (0.0, 0.0, 0.0)))
    if "dh" in figures:
        return Robot.from_dh(figures["dh"], name=name, limits=figures["limits"], tool=end, **shared)
    if "stretched" in figures:
        steps, lean = [], np.eye(4)
        for axis, *place in rows:
            turn = placement((0.0, 0.0, 0.0), np.deg2rad(LEANS[axis]).tolist())
            steps.append(np.linalg.inv(lean) @ placement(place) @ turn)
            lean = turn
        end = np.linalg.inv(lean) @ end
    else:
        steps = [placement(row[:3], np.deg2rad(row[3:]).tolist()) for row in rows]
    links = figures.get("inertials")
    stated: dict[str, Any] = {
        "tip": figures["tip"],
        "tip_pose": end,
        "capsules": capsules_of(figures),
        **shared,
        **changes,
    }
    robot = arm(
        name,
        [names.format(i + 1) for i in range(len(rows))] if isinstance(names, str) else names,
        steps,
        None if links is None else inertials_of(links),
        figures["limits"],
        **stated,
    )
    return replace(robot, findings=(*robot.findings, *map(note, figures.get("notes", ()))))


def inertials_of(rows: Sequence[Sequence[float]]) -> list[Inertial]:
    """Masses from rows of a file."""
    return [Inertial(mass=row[0], com=np.array(row[1:4]), inertia=symmetric(*row[4:])) for row in rows]


def capsules_of(figures: Mapping[str, Any]) -> list[Capsule]:
    """The links of a file's table."""
    return [Capsule(a, b, r, frame=frame, name=name) for name, frame, a, b, r in figures.get("capsules", ())]


def xarm7(*, rotors: bool = True) -> Robot:
    """UFACTORY xArm 7; ``rotors`` is whether it has the rotor inertia that its file states."""
    return arm_of_file("xarm7", **({} if rotors else {"rotors": 0.0}))


def panda(*, hand: bool = True) -> Robot:
    """Franka Emika Panda and its hand with closed fingers, the tip between these, or without the hand."""
    if not hand:
        return arm_of_file("panda")
    figures = published("panda")
    own, last = _radians(figures["hand"]), "panda_joint7"
    mount = placement(figures["tip_place"]) @ placement((0, 0, 0), (0, 0, own["turn"]))
    fingers = mount @ placement((0.0, 0.0, own["fingers_at"]))
    parts = []
    for body in capsules_of(own):
        T = mount if body.frame == "hand" else fingers
        a, b = (T[:3, :3] @ point + T[:3, 3] for point in (body.a, body.b))
        parts.append(Capsule(a, b, body.radius, frame=last, name=body.name))
    palm, finger = inertials_of(own["inertials"])
    return arm_of_file(
        "panda",
        tip=own["tip"],
        tip_pose=mount @ placement((0.0, 0.0, own["tip_at"])),
        payload=[(mount, palm), (fingers, finger), (fingers, finger)],
        capsules=[*capsules_of(figures), *parts],
    )


def dual_panda(*, apart: float = 0.6) -> Robot:
    """Two Pandas beside each other on one base, facing the same way: 14 joints, masses and both hands.

    Joints are ``left_joint1`` to ``left_joint7`` and ``right_joint1`` to ``right_joint7``, the tips
    ``left_hand`` and ``right_hand`` between the finger tips. The arms stand at y = ``apart`` / 2 and
    -``apart`` / 2, and at neutral their hands are as far from each other.

    Args:
        apart: Distance of the two arms, > 0 [m].
    """
    one, distance = panda(), positive("apart", apart, "m")
    model = pin.Model()
    model.name, model.gravity = "dual_panda", one.model.gravity
    for side, share in SIDES:
        names = {name: name.replace("panda", side) for name in one.joints} | {one.tip: f"{side}_hand"}
        graft(model, 0, placement((0.0, share * distance, 0.0)), one.model, names)
    found = Robot.from_pinocchio(
        model,
        tips=[f"{side}_hand" for side, _ in SIDES],
        limits=joined(one.limits, one.limits),
        neutral=np.tile(one.neutral, 2),
        length=one.length,
    )
    bodies = [_beside(body, side, share * distance) for side, share in SIDES for body in one.capsules]
    return found.with_capsules(bodies)


def _beside(body: Capsule, side: str, y: float) -> Capsule:
    """A link of one of the arms; what does not move stands where the arm does."""
    name, frame = (word.replace("panda", side) for word in (body.label, body.frame or "universe"))
    away = np.array([0.0, y if frame == "universe" else 0.0, 0.0])
    return Capsule(body.a + away, body.b + away, body.radius, frame=frame, name=name)


def planar(
    *,
    count: int | None = None,
    lengths: Sequence[float] | None = None,
    continuous: bool = False,
    vertical: bool = False,
) -> Robot:
    """Planar arm of slender links, moving in the x-y plane of the base.

    Source: none, a made-up arm for studies of redundancy: 4 kg/m, 150 degrees either way, 1 rad/s, 5 rad/s2.

    Args:
        count: The number of joints, 1 to 64; without it and without lengths 4. The links are equal and 1.5 m
            long in all: more joints are shorter and leave more redundancy.
        lengths: The lengths of the links instead of their number, (n,), each > 0 [m]; longer is heavier.
        continuous: Whether the joints turn without end; without it they turn 150 degrees either way.
        vertical: Whether gravity is (0, -9.81, 0) m/s2; without it the arm moves in a horizontal plane.
    """
    sizes = _lengths(count, lengths)
    limits: dict[str, Any] = dict(v_max=1.0) if continuous else dict(q_min=-BEND, q_max=BEND, v_max=1.0)
    start = np.full(len(sizes), np.pi / (2.0 * len(sizes)))
    own = ", ".join(f"{size:g}" for size in sizes) if lengths is not None else f"{len(sizes)}"
    return _slender(
        f"planar({own})", sizes, limits, neutral=start, vertical=vertical, continuous=bool(continuous)
    )


def _lengths(count: Any, lengths: Any) -> list[float]:
    """The lengths of the links [m]."""
    if lengths is None:
        number = COUNT if count is None else count
        if isinstance(number, bool) or not isinstance(number, int) or not 1 <= number <= JOINTS:
            raise InputError(f"count is {count!r}, expected a number of joints from 1 to {JOINTS}")
        return [REACH / number] * number
    if count is not None:
        raise InputError(
            f"count is {count!r} together with lengths, which already say it; leave one of them out"
        )
    try:
        sizes = np.atleast_1d(np.asarray(lengths, dtype=np.float64))
    except (TypeError, ValueError, OverflowError):
        sizes = np.empty(0)
    if sizes.ndim != 1 or not 1 <= sizes.size <= JOINTS or not ((sizes > 0.0) & (sizes <= LONGEST)).all():
        raise InputError(
            f"lengths is {lengths!r:.80}, expected 1 to {JOINTS} positive numbers up to {LONGEST:g} [m]"
        )
    return [float(size) for size in sizes]


def planar6(*, vertical: bool = False) -> Robot:
    """Planar arm of six links: joint 1 has a motor, joints 2 to 6 push rods; tip at the end of link 6.

    Source: Jin et al. 2017, table 1: link lengths and position limits. The paper gives no masses,
    speed or acceleration limits. Chosen here: slender links of 4 kg/m, 0.4 rad/s, 2 rad/s2, no torque limit,
    start at pi/12 in every joint, and motion in a horizontal plane, so that gravity is zero.

    Args:
        vertical: Gravity (0, -9.81, 0) m/s2 instead of zero.
    """
    limits = dict(
        q_min=[-1.536, 0.052, 0.035, 0.052, 0.035, 0.009],
        q_max=[1.431, 0.816, 0.621, 0.599, 0.599, 0.445],
        v_max=0.4,
        a_max=2.0,
    )
    lengths = (0.301, 0.290, 0.230, 0.225, 0.214, 0.103)
    return _slender("planar6", lengths, limits, neutral=np.full(6, np.pi / 12), vertical=vertical)


def _slender(
    name: str,
    lengths: Sequence[float],
    limits: Mapping[str, Any],
    *,
    neutral: FloatArray,
    vertical: bool,
    continuous: bool = False,
) -> Robot:
    """Planar arm of uniform slender links: m = DENSITY l, centre of mass at l/2, I_zz = m l^2 / 12."""
    masses = [
        Inertial(
            mass=DENSITY * length,
            com=np.array([length / 2, 0.0, 0.0]),
            inertia=np.diag([0.0, 1.0, 1.0]) * (DENSITY * length**3 / 12.0),
        )
        for length in lengths
    ]
    return arm(
        name,
        [f"j{i + 1}" for i in range(len(lengths))],
        [placement((step, 0.0, 0.0)) for step in (0.0, *lengths[:-1])],
        masses,
        limits,
        tip="tip",
        tip_pose=placement((lengths[-1], 0.0, 0.0)),
        neutral=neutral,
        default_rows=("x", "y") if len(lengths) > 1 else ("x",),
        gravity=DOWN if vertical else FLAT,
        continuous=continuous,
    )


WITH_OPTIONS: dict[str, Callable[..., Robot]] = {
    each.__name__: each for each in (dual_panda, panda, planar, planar6, xarm7)
}
"""Arms that are more than their file, by name."""
