"""``ftqp identify``: what an arm has beside its model, from logs; or the motion to record them of."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ftqp.app.output.console import ExitCode, Shown, Table, answer, progress, say
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, unknown

if TYPE_CHECKING:
    from ftqp.model.fitting.exciting_motion import ExcitingMotion
    from ftqp.model.fitting.fitted_arm import FittedArm
    from ftqp.model.fitting.torque_log import TorqueLog
    from ftqp.model.robot import Robot

SHORT = 10.0
"""A log of less motion [s] is said to be short."""
APART = 5e-3
"""Surroundings are looked at as far as bodies are so far apart [m] when an exciting motion is chosen."""
NOISE = (1e-5, 0.1)
"""Of positions [rad] and torques [N m] in a rehearsal."""


class _Arm(NamedTuple):
    """An arm, and what its scenario says where it has one."""

    robot: "Robot"
    setup: Any = None


def identify(
    logs: list[Path] | None = None,
    robot: str | None = None,
    tip: str | None = None,
    late: float = 0.0,
    only: str | None = None,
    motion: str | None = None,
    seconds: float = 20.0,
    rehearse: Path | None = None,
    output: Path | None = None,
    as_json: bool = False,
) -> ExitCode:
    """Find rotors, friction, load, gains and offsets of an arm from logs with torques.

    Options:
        logs [LOG...]: CSV files, or folders of runs.
        robot --robot ARM: A scenario, a robot of the catalog, a URDF or MJCF; a run knows its.
        tip --tip FRAME: Where the load is, of a URDF; its only end if left out.
        late --late SECONDS: How much later torques act than positions of a row.
        only --only A,B,...: Look only for some of rotors, coulomb, viscous, gains, offsets, load.
        motion --motion ARM: Write a motion that excites all, in place of reading logs.
        seconds --seconds T: How long that motion is.
        rehearse --rehearse LOG: Let the scenario's arm in physics go that motion, and write its log.
        output -o --output FILE: The motion (.csv), or a .urdf of what was found.
    """
    from ftqp.app.commands.inspection import arm_of
    from ftqp.model.fitting.fitted_arm import KINDS, fitted_arm

    if motion is not None:
        if logs or robot is not None:
            raise InputError(
                "--motion writes a motion for an arm and reads no log; leave LOG and --robot out"
            )
        return _write_motion(_Arm(*arm_of(motion, tip)), seconds, output, rehearse, as_json)
    if not logs:
        raise InputError("no log was given; name CSV files or runs, or --motion ARM for a motion to record")
    if rehearse is not None:
        raise InputError("--rehearse goes with --motion, whose motion it goes; leave it out")
    arm = _Arm(*arm_of(robot or str(_scenario_of(logs)), tip))
    kinds = list(KINDS) if only is None else [name.strip() for name in only.split(",") if name.strip()]
    for name in kinds:
        if name not in KINDS:
            raise unknown("unknown", name, "ftqp identify", KINDS)
    if output is not None and (output.suffix != ".urdf" or output.exists()):
        raise InputError(f"{output} has to be a new file that ends in .urdf, which keeps rotors and friction")
    with progress("fitting", 1.0):
        every = [_log(path, arm, late) for path in logs]
        found = fitted_arm(arm.robot, every, kinds)
    if output is not None:
        output.write_text(found.fitted.to_urdf(), encoding="utf-8")
    answer(_facts(found, kinds, output), as_json, _shown(found, kinds))
    for note in _notes(found, kinds, every):
        say(f"note: {note}")
    if output is not None:
        say(f"{output}: the arm with these rotors and this friction")
    return ExitCode.DONE


def _scenario_of(logs: list[Path]) -> Path:
    """The scenario of the first run."""
    from ftqp.app.run.runs import SCENARIO

    scenario = logs[0] / SCENARIO
    if not scenario.is_file():
        raise InputError(
            f"{logs[0]} does not say of which arm it is; name it by --robot, a scenario, a robot or a URDF"
        )
    return scenario


def _log(path: Path, arm: _Arm, late: float) -> "TorqueLog":
    """A log, from a CSV file or a run."""
    from ftqp.sim.log.log_file import load_log
    from ftqp.sim.torque_logs import torque_log_of_csv, torque_log_of_run

    if path.suffix.lower() == ".csv":
        return torque_log_of_csv(path, arm.robot.joints, late)
    latency = 0.0 if arm.setup is None else arm.setup.planner.drive.latency
    return torque_log_of_run(load_log(path), arm.robot.joints, latency)


def _write_motion(
    arm: _Arm, seconds: float, file: Path | None, rehearsal: Path | None, as_json: bool
) -> ExitCode:
    """The motion, and the log of its rehearsal."""
    from ftqp.model.fitting.exciting_motion import exciting_motion
    from ftqp.sim.torque_logs import write_motion

    if file is None or file.suffix.lower() != ".csv" or file.exists():
        raise InputError(f"-o is {file}, expected a new .csv file for the motion, for example -o motion.csv")
    if rehearsal is not None and arm.setup is None:
        raise InputError("--rehearse takes what is true of the arm from a scenario; name one by --motion")
    dt = 0.001 if arm.setup is None else arm.setup.planner.dt
    start = arm.robot.neutral if arm.setup is None else arm.setup.q
    with progress("choosing a motion", 1.0):
        moves = exciting_motion(arm.robot, start, duration=seconds, dt=dt, clear=_clear(arm))
    write_motion(file, arm.robot.joints, moves)
    facts: dict[str, Any] = {
        "file": str(file), "samples": len(moves.t), "seconds": float(moves.t[-1]),
        "range": np.ptp(moves.q, axis=0).tolist(), "v": np.abs(moves.v).max(axis=0).tolist(),
        "a": np.abs(moves.a).max(axis=0).tolist(),
    }  # fmt: skip
    if rehearsal is not None:
        facts["rehearsal"] = str(rehearsal)
        _rehearse(arm, moves, rehearsal)
    joints = zip(arm.robot.joints, facts["range"], facts["v"], facts["a"], strict=True)
    rows = [(joint, f"{way:.2f}", f"{v:.2f}", f"{a:.2f}") for joint, way, v, a in joints]
    heads = ("joint", "way [rad]", "v [rad/s]", "a [rad/s2]")
    answer(facts, as_json, [Table(f"{file}: {seconds:g} s", heads, rows)])
    say("go it, record t, q.JOINT and tau.JOINT of every joint, and hand the file to ftqp identify")
    return ExitCode.DONE


def _clear(arm: _Arm) -> Callable[[FloatArray], bool] | None:
    """Whether the arm keeps off itself and off what is in the scenario; None where its bodies are unknown."""
    from ftqp.control.planner.planner import Planner
    from ftqp.control.scene.placed_shapes import Clearance, Scene

    if not arm.robot.capsules:
        return None
    planner = None if arm.setup is None or not arm.setup.tables.scene else arm.setup.planner
    if planner is None:
        planner = Planner(arm.robot, scene=Scene(), clearance=Clearance())
    return lambda q: all(float(d.min()) > APART for d in planner.distances(q).values())


def _rehearse(arm: _Arm, moves: "ExcitingMotion", file: Path) -> None:
    """The log of the scenario's own arm in physics."""
    from ftqp.sim.torque_logs import rehearsed, write_torque_log

    table = arm.setup.tables.simulation.mujoco
    with progress("rehearsing", 1.0):
        log = rehearsed(
            arm.robot, moves, table.true_arm(), bandwidth=table.bandwidth, position_noise=NOISE[0],
            torque_noise=NOISE[1], seed=arm.setup.tables.simulation.seed,
        )  # fmt: skip
        write_torque_log(file, arm.robot.joints, log)


def _facts(found: "FittedArm", kinds: list[str], file: Path | None) -> dict[str, Any]:
    """What ``--json`` prints."""
    from ftqp.model.fitting.fitted_arm import LOAD

    joints, payload = found.robot.joints, found.payload
    facts: dict[str, Any] = {"robot": found.robot.name, "seconds_left_out": found.left_out}
    for name in (kind for kind in kinds if kind != LOAD):
        values = zip(joints, getattr(found, name), found.errors[name], found.not_shown[name], strict=True)
        facts[name] = {
            joint: {"value": float(x), "error": float(e), "shown": not bool(no)} for joint, x, e, no in values
        }
    if LOAD in kinds:
        mass = float(found.load[0])
        facts[LOAD] = {
            "mass": mass, "mass_error": float(found.errors[LOAD][0]),
            "com": None if payload is None else list(payload.com),
        }  # fmt: skip
    facts["unexplained"] = dict(zip(joints, found.left.tolist(), strict=True))
    facts["unexplained_before"] = dict(zip(joints, found.before.tolist(), strict=True))
    return facts if file is None else {**facts, "file": str(file)}


def _shown(found: "FittedArm", kinds: list[str]) -> Shown:
    """What a person reads."""
    from ftqp.model.fitting.fitted_arm import KINDS, LOAD

    each = [name for name in kinds if name != LOAD]
    rows = []
    for i, joint in enumerate(found.robot.joints):
        cells = [
            _number(getattr(found, name)[i], found.errors[name][i], found.not_shown[name][i]) for name in each
        ]
        rows.append((joint, *cells, f"{found.before[i]:.3g} -> {found.left[i]:.3g}"))
    heads = [f"{KINDS[name].about} [{KINDS[name].unit}]" for name in each]
    title = f"{found.robot.name} compared with its model, with standard errors"
    table = Table(title, ("joint", *heads, "unexplained [N m]"), rows)
    if LOAD not in kinds:
        return [table]
    mass, error, payload = float(found.load[0]), float(found.errors[LOAD][0]), found.payload
    if payload is None:
        return [table, f"No load shows at the end effector: {mass:.3f} kg, standard error {error:.3f}."]
    x, y, z = (1e3 * c for c in payload.com)
    return [
        table,
        f"A load of {mass:.3f} kg (standard error {error:.3f}) with its centre at {x:.0f}, {y:.0f}, {z:.0f} "
        f"mm of {found.robot.tip}: ftqp.Payload({mass:.3f}, ({x / 1e3:.4f}, {y / 1e3:.4f}, {z / 1e3:.4f})).",
    ]


def _number(value: float, error: float, not_shown: bool) -> str:
    """A value with its standard error."""
    return "not shown" if not_shown else f"{value:.3g} ± {error:.1g}"


def _notes(found: "FittedArm", kinds: list[str], logs: list["TorqueLog"]) -> list[str]:
    """What to know before relying on it."""
    from ftqp.model.fitting.fitted_arm import KINDS, LOAD

    joints, notes = found.robot.joints, []
    for name in (kind for kind in kinds if kind != LOAD):
        silent = [joint for joint, no in zip(joints, found.not_shown[name], strict=True) if no]
        if silent:
            notes.append(f"the motion does not show the {KINDS[name].about} of {', '.join(silent)}")
    if LOAD in kinds and found.not_shown[LOAD][0]:
        notes.append("the motion does not show the load's mass; turn the wrist and move faster")
    seconds = sum(float(log.t[-1] - log.t[0]) for log in logs) - found.left_out
    if found.left_out:
        notes.append(f"{found.left_out:.2g} s lie in gaps between samples and were left out")
    if seconds < SHORT:
        notes.append(f"{seconds:.3g} s of motion are little; 20 s of `ftqp identify --motion` show more")
    return notes
