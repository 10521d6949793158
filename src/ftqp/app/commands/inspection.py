"""``ftqp inspect``: what was read of an arm, what it can do, and which joints it can lose."""

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from re import sub
from typing import TYPE_CHECKING, Any

import numpy as np

from ftqp.app.output.console import ExitCode, Shown, Table, answer, say
from ftqp.control.planner.planner import Planner
from ftqp.control.scene.placed_shapes import Clearance
from ftqp.core.errors import InputError, MissingPackage, ModelError, unknown
from ftqp.core.quiet import quiet
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model import catalog
from ftqp.model.chain import frame_id
from ftqp.model.collision_geometry import volume_ratios
from ftqp.model.followers import coupled_columns, followers_of
from ftqp.model.frames import joint_of_frames
from ftqp.model.limits import RISE_TIME
from ftqp.model.posture import (
    NEAR_SINGULAR,
    Locks,
    acceleration_by_torque,
    gravity_torques,
    least_singular_value,
    locks,
    scaled_jacobian,
)
from ftqp.model.robot import Robot

if TYPE_CHECKING:
    from ftqp.app.scenario.setup import Setup

TASKS = {"pose": COMPONENTS, "position": COMPONENTS[:3]}
"""Tasks whose locks are looked at, by name."""
MODELS = (".urdf", ".xml", ".mjcf")
"""How names of files end that describe an arm."""
IN_THE_SHELL = (
    (r"choose one with tip=, or several with tips=\(\.\.\.\)", "choose one with --tip"),
    (r"locked=\['([^']*)'\]", r"--locked \1"),
)
"""How a remedy that names an argument of Python is spelled in the shell."""
ANOTHER = "another arm is read from its file, for example arm.urdf --tip tool0"
PICTURE = Path("figures") / "arm.png"
LIMITS = ("q_min", "q_max", "v_max", "a_max", "j_max", "tau_max")
NUMBERS = (*LIMITS, "a by torque", "neutral", "gravity", "of tau_max")


def robot_of(source: str, tips: list[str], locked: list[str], *, holds: bool = False) -> Robot:
    """The robot of the catalog, or that of a URDF or MJCF file."""
    file = Path(source)
    known = source.partition("(")[0] in catalog.names()
    if not file.is_file() and file.suffix.lower() not in MODELS and (known or not file.exists()):
        if not known:
            raise unknown("robot or file", source, "ftqp", catalog.names(), ANOTHER)
        if tips or locked:
            raise InputError(
                f"{source} is a robot of the catalog, which has its tip; leave --tip, --locked out"
            )
        return catalog.load(source)
    read = Robot.from_mjcf if kind_of(file) == "mjcf" else Robot.from_urdf
    try:
        with quiet():  # the commands print findings
            return read(file, None, locked, tips or None)
    except ModelError as error:
        what = str(error).partition("\n")[0]
        raise ModelError(what, [_in_the_shell(sentence, holds) for sentence in error.findings]) from error


def kind_of(file: Path) -> str:
    """What a file of a model is, by its beginning."""
    head = file.read_bytes()[:4096].decode("utf-8", "replace") if file.is_file() else ""
    return "mjcf" if "<mujoco" in head else "urdf"


def is_arm(source: str) -> bool:
    """Whether this is a robot of the catalog or a file of a model, and no scenario."""
    return source.partition("(")[0] in catalog.names() or Path(source).suffix.lower() in MODELS


def arm_of(source: str, tip: str | None, overrides: Sequence[str] = ()) -> "tuple[Robot, Setup | None]":
    """The arm of the catalog or of a file, or that of a scenario, with what else that says."""
    from ftqp.app.scenario import document
    from ftqp.app.scenario.setup import load

    if is_arm(source):
        if overrides:
            raise InputError(f"{source} is a robot, no scenario, so that --set has nothing to change")
        return robot_of(source, [] if tip is None else [tip], []), None
    if not Path(source).suffix and not Path(source).exists() and source not in document.bundled():
        valid = [*catalog.names(), *document.bundled()]
        raise unknown("robot, scenario or file", source, "ftqp", valid, ANOTHER)
    if tip is not None:
        raise InputError(f"{source} is a scenario, whose [robot] names the tip; leave --tip out")
    setup = load(source, overrides)
    return setup.robot, setup


def _in_the_shell(sentence: str, holds: bool) -> str:
    """A finding with its remedies as options of a command, in place of arguments of Python."""
    for python, shell in IN_THE_SHELL[: None if holds else 1]:
        sentence = sub(python, shell, sentence)
    return sentence


def inspect(
    source: str,
    tips: list[str],
    locked: list[str],
    folder: Path | None,
    *,
    as_json: bool,
    survival: bool = False,
    capsules: bool = False,
) -> ExitCode:
    """Say what an arm is, draw it into ``folder``; with ``survival`` also where locks are survived."""
    robot = robot_of(source, tips, locked, holds=True)
    found = facts(robot, "file" if Path(source).is_file() else "catalog")
    if survival:
        found["survival"] = _survival(robot, found["possible"])
    if capsules:
        found["capsules"], found["pairs_left_out"] = _bodies(robot)
    found["figure"] = None if folder is None else _picture(robot, folder)
    answer(found, as_json, _shown(found))
    return ExitCode.DONE


def facts(robot: Robot, source: str) -> dict[str, Any]:
    """What ``ftqp inspect --json`` prints, but for the picture."""
    model, q = robot.model, robot.neutral
    configuration = robot.configuration(q)
    data, frame = model.createData(), frame_id(model, robot.tip)
    J = scaled_jacobian(model, data, frame, configuration, robot.default_rows, robot.length)
    J = coupled_columns(robot.chain, J)
    tau = reserve = np.full(robot.nv, np.nan)
    if robot.has_inertia:
        tau = np.abs(coupled_columns(robot.chain, gravity_torques(model, data, configuration)))
        reserve = acceleration_by_torque(model, robot.chain, robot.limits)
    share = tau / robot.limits.tau_max
    tasks, way = _tasks(robot), len(robot.chain.way(robot.chain.tip_joint))
    motors = len(set(robot.chain.lead[robot.chain.way(robot.chain.tip_joint)].tolist()))
    arms = {tip: robot.arm_to(tip) for tip in robot.tips} if len(robot.tips) > 1 else {robot.tip: robot}
    by_tip = {tip: {name: locks(arm, rows) for name, rows in tasks.items()} for tip, arm in arms.items()}
    by_task = by_tip[robot.tip]
    followers = followers_of(robot.joints, robot.chain)
    return {
        "robot": robot.name,
        "tip": robot.tip,
        "tips": list(robot.tips),
        "base_to_tip": way,
        "rows": list(robot.default_rows),
        "has_inertia": robot.has_inertia,
        "length": robot.length,
        "mass": float(robot.chain.mass.sum()) if robot.has_inertia else None,
        "joints": [
            _joint(robot, i, tau[i], share[i], reserve[i], by_tip[_tip_of(arms, joint)])
            for i, joint in enumerate(robot.joints)
        ],
        "mimics": {
            name: {"joint": one.leader, "ratio": one.ratio, "offset": one.offset}
            for name, one in followers.items()
        },
        "by_tip": {
            tip: {"joints": list(arm.joints), "structural": _structural(by_tip[tip])}
            for tip, arm in arms.items()
        },
        "frames": joint_of_frames(robot),
        "limits_from": _origin(robot, source),
        "friction": bool(robot.viscous.any() or robot.coulomb.any()),
        "sigma_min": least_singular_value(J),
        "sigma_min_share": least_singular_value(J) / robot.length,
        "gravity_margin": float(1.0 - share.max()) if robot.has_inertia else None,
        "redundancy": {name: motors - len(rows) for name, rows in tasks.items()},
        "possible": {name: result.possible for name, result in by_task.items()},
        "structural": _structural(by_task),
        "findings": [
            {"severity": finding.severity.name.lower(), "sentence": str(finding)}
            for finding in robot.findings
        ],
    }


def _structural(by_task: dict[str, Locks]) -> dict[str, list[str]]:
    """The joints that no posture can do without, by task; none of a task that is impossible anyway."""
    return {name: list(one.fatal) if one.possible else [] for name, one in by_task.items()}


def _tip_of(arms: dict[str, Robot], joint: str) -> str:
    """The first tip that a joint moves."""
    return next((tip for tip, arm in arms.items() if joint in arm.joints), next(iter(arms)))


def _survival(robot: Robot, possible: dict[str, bool]) -> dict[str, dict[str, Any]]:
    """For each possible task the shares of the workspace at which each joint's lock is survived, and any."""
    from ftqp.analysis.survival.survival_map import survival_map  # compiles what nothing else here needs

    found = {}
    for task, rows in _tasks(robot).items():
        if possible[task]:
            shares = survival_map(robot, rows)
            found[task] = {"any_joint": shares.any_joint, "per_joint": shares.per_joint, "way": shares.way}
    return found


def _bodies(robot: Robot) -> tuple[list[dict[str, Any]], list[list[str]]]:
    """The capsules of a robot, and the pairs of them that are built too near to be kept apart."""
    clearance = Clearance(ignore=[(a.label, b.label) for a, b in combinations(robot.capsules, 2)])
    ratios = volume_ratios(robot)
    found = [
        {
            "name": one.label,
            "frame": one.frame,
            "a": one.a.tolist(),
            "b": one.b.tolist(),
            "radius": one.radius,
            "estimated": one.estimated,
            "volume_ratio": ratios.get(one.frame or ""),
        }
        for one in robot.capsules
    ]
    planner = Planner(robot, clearance=clearance)
    return found, [list(pair) for pair in planner.pairs_left_out]


def _tasks(robot: Robot) -> dict[str, tuple[str, ...]]:
    """Pose and position, and the robot's own rows where they are others."""
    own = robot.default_rows
    return TASKS if own in TASKS.values() else {", ".join(own): own, **TASKS}


def _joint(
    robot: Robot, i: int, tau: float, share: float, reserve: float, by_task: dict[str, Locks]
) -> dict[str, Any]:
    limits, chain, name = robot.limits, robot.chain, robot.joints[i]
    kind = "prismatic" if chain.prismatic[i] else "continuous" if chain.continuous[i] else "revolute"
    return {
        "name": name,
        "kind": kind,
        **{key: float(getattr(limits, key)[i]) for key in LIMITS},
        "a_by_torque": float(reserve),
        "neutral": float(robot.neutral[i]),
        "gravity": float(tau),
        "gravity_share": float(share),
        "viscous": float(chain.viscous[i]),
        "coulomb": float(chain.coulomb[i]),
        "rotor_inertia": float(chain.armature[i]),
        "left_when_locked": {task: result.left.get(name, 1.0) for task, result in by_task.items()},
    }


def _origin(robot: Robot, source: str) -> dict[str, str]:
    """Where each kind of limit comes from."""
    guess = [str(f) for f in robot.findings if str(f).startswith("no acceleration limit is known")]
    rule = f"rule v_max / {RISE_TIME:g} s"
    some = any(one.startswith("no acceleration limit is known for") for one in guess)
    return {
        **dict.fromkeys(LIMITS, source),
        "a_max": f"{source}, for some joints of the {rule}" if some else rule if guess else source,
    }


def _picture(robot: Robot, folder: Path) -> str | None:
    """The picture's file; None, said in words, where nothing can draw."""
    try:
        from ftqp.viz.figures.arm_picture import robot_figure
    except MissingPackage as error:
        say(f"no picture: {error}")
        return None
    file = folder / PICTURE
    try:
        file.parent.mkdir(parents=True)
    except OSError as error:
        raise InputError(f"folder {file.parent} cannot be made: {error.strerror}") from error
    title = f"{robot.name} at its neutral posture, tip {robot.tip}"
    return str(robot_figure(file, title, robot, robot.neutral))


def _shown(found: dict[str, Any]) -> Shown:
    """The facts as tables and sentences."""
    survived = found.get("survival", {})
    rows = [
        (
            str(k),
            joint["name"],
            joint["kind"],
            *(_figure(joint[key]) for key in (*LIMITS, "a_by_torque", "neutral", "gravity")),
            _percent(joint["gravity_share"]),
            f"{_figure(joint['viscous'])}, {_figure(joint['coulomb'])}"
            if found["friction"]
            else "none known",
            _figure(joint["rotor_inertia"]),
            *map(_percent, joint["left_when_locked"].values()),
            *(_percent(shares["per_joint"][joint["name"]]) for shares in survived.values()),
        )
        for k, joint in enumerate(found["joints"], 1)
    ]
    left = [f"{task} left" for task in found["redundancy"]]
    left += [f"{task} survived" for task in survived]
    heads = ("", "joint", "kind", *NUMBERS, "friction", "rotor", *left)
    count, way = len(found["joints"]), found["base_to_tip"]
    beside = "" if count == way else f" of {count}"
    title = f"{found['robot']}: {way}{beside} joints from base to {found['tip']} [rad, m, s, N m, kg m2]"
    shown: list[str | Table] = [
        Table(title, heads, rows, (*NUMBERS, "rotor", *left)),
        Table("Frames, by the joint that they move with", ("joint", "frames"), _by_joint(found["frames"])),
    ]
    if "capsules" in found:
        rows = [_capsule_row(one) for one in found["capsules"]]
        heads = ("body", "frame", "from", "to", "radius", "volume by that of its geometry")
        shown.append(Table("Bodies as capsules, in their frames, in metres", heads, rows, heads[4:]))
        if found["pairs_left_out"]:
            pairs = ", ".join(f"{a} and {b}" for a, b in found["pairs_left_out"])
            shown.append(f"Built too near to each other to be kept apart: {pairs}.")
    shown += _sentences(found)
    shown += [f"{finding['severity']}: {finding['sentence']}" for finding in found["findings"]]
    if found["figure"] is not None:
        shown.append(f"Picture: {found['figure']} (--out DIR puts it elsewhere, --no-figures draws none)")
    return shown


def _capsule_row(one: dict[str, Any]) -> tuple[str, ...]:
    """A capsule as a row of the table."""
    ends = (", ".join(f"{round(x, 3) + 0.0:.3f}" for x in one[end]) for end in ("a", "b"))
    ratio = "-" if one["volume_ratio"] is None else f"{one['volume_ratio']:.1f}"
    ratio = "estimated" if one["estimated"] else ratio
    return one["name"], one["frame"] or "", *ends, f"{one['radius']:.3f}", ratio


def _by_joint(frames: dict[str, str | None]) -> list[tuple[str, str]]:
    """The names of frames, a row for each joint, and one for those that do not move."""
    moving = dict.fromkeys(joint for joint in frames.values() if joint is not None)
    return [
        (joint or "none", ", ".join(name for name, own in frames.items() if own == joint))
        for joint in (*moving, None)
        if joint in frames.values()
    ]


def _sentences(found: dict[str, Any]) -> list[str]:
    near = " (near a singularity)" if found["sigma_min_share"] < NEAR_SINGULAR else ""
    lines = [
        f"Limits are those of the {found['limits_from']['q_min']}, accelerations of the "
        f"{found['limits_from']['a_max']}.",
        f"At neutral the task's sigma_min is {found['sigma_min']:.3g} m, {found['sigma_min_share']:.2f} of "
        f"the characteristic length {found['length']:.3g} m{near}.",
    ]
    if found["gravity_margin"] is None:
        lines.append("No masses are known, so torques are neither limited nor computed.")
    else:
        lines.append(
            f"To hold the arm's {found['mass']:.3g} kg there takes at most "
            f"{_percent(1.0 - found['gravity_margin'])} of a joint's torque limit."
        )
    if len(found["by_tip"]) > 1:
        ways = "; ".join(f"{tip} by {len(one['joints'])} joints" for tip, one in found["by_tip"].items())
        lines.append(
            f"Several tips: {ways}. What a lock leaves is that of the first end effector that the joint "
            "moves."
        )
    for name, one in found["mimics"].items():
        lines.append(f"{name} mimics {one['joint']}: q = {one['ratio']:g} q + {one['offset']:g}.")
    for task in found["redundancy"]:
        lines.append(f"Task {task}: {_redundancy(found, task)}")
    if found["gravity_margin"] is not None:
        lines.append(
            "'a by torque' is the acceleration that a motor can give in addition to gravity while the other "
            "joints rest, at the heaviest of 100 random postures."
        )
    lines.append(
        "'left' is the share of 400 random postures at which a lock of the joint leaves the task regular."
    )
    for task, shares in found.get("survival", {}).items():
        lines.append(
            f"Task {task}: lines of {shares['way']:.2g} m to all sides are still possible at "
            f"{_percent(shares['any_joint'])} of the workspace whichever joint locks; 'survived' is the "
            "share for each joint."
        )
    return lines


def _redundancy(found: dict[str, Any], task: str) -> str:
    extra, fatal = found["redundancy"][task], found["structural"][task]
    if not found["possible"][task]:
        return "this arm cannot do it, whatever its posture."
    if extra <= 0:
        return "no redundancy, so a locked joint costs a direction."
    spare = f"{extra} joint{'s' if extra > 1 else ''} more than rows"
    if fatal:
        return f"{spare}; no posture survives a lock of {', '.join(fatal)}."
    return f"{spare}; a lock of any one joint can be survived."


def _figure(value: float) -> str:
    if np.isnan(value):
        return "-"
    return "none" if np.isinf(value) else f"{round(value, 6):.4g}"


def _percent(share: float) -> str:
    return "-" if np.isnan(share) else f"{100.0 * share:.0f} %"
