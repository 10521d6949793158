"""``ftqp connect``: the first motion with an arm in simulation, what it shows, and the file of it."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ftqp.app.output.console import ExitCode, Shown, Table, answer, progress, say
from ftqp.core.errors import InputError

if TYPE_CHECKING:
    from ftqp.app.scenario.setup import Setup
    from ftqp.control.following.connection import Connection
    from ftqp.control.planner.planner import Planner
    from ftqp.sim.plants.plant import Plant
    from ftqp.sim.schedule import Schedule
    from ftqp.sim.sensors.joint_sensors import JointSensors

DT = 0.002
"""Sampling period of an arm of which nothing says it [s]."""
NOTICED = (
    "A joint that is off by so much more than its servo explains is noticed within 0.1 s, and one that locks "
    "so long after it should have moved, if that was with 0.1 rad/s or m/s. Nothing shows of one that rests."
)
"""What the columns of the table mean."""
IDEAL = (
    "note: an arm in simulation has servos with simulation.plant=servo, which lag if the planner's drive "
    "takes no velocities, or with plant=mujoco"
)
"""What helps where samples are the commands."""


def connect(
    source: str,
    tip: str | None = None,
    overrides: list[str] | None = None,
    seconds: float | None = None,
    output: Path | None = None,
    as_json: bool = False,
) -> ExitCode:
    """Let a simulated arm make its first motion: what is estimated of each servo, noticed, and missing.

    Your own arm makes it in your loop: ftqp.connect(planner, q), docs/connect-your-robot.md.

    Options:
        source SCENARIO|ROBOT|FILE: A scenario, whose [path] may be missing; a robot; its URDF or MJCF.
        tip --tip FRAME: The end effector of a model; its only end if left out.
        seconds --seconds T: About how long the motion takes; 10 s, or more for many joints.
        output -o --output FILE: A file of the estimates, for drive.known.
    """
    from ftqp.app.commands.inspection import is_arm
    from ftqp.control.following.connection import Connection

    if output is not None and not output.absolute().parent.is_dir():
        raise InputError(f"-o is {output}, but {output.absolute().parent} is no folder; make it first")
    setup = _setup(source, tip, overrides or [])
    if setup.world is not None:
        raise InputError(f"the base of {setup.name} moves, expected one that stands; leave out [base]")
    robot, planner, plant, sensors = setup.robot, setup.planner, setup.plant, setup.sensors
    start, schedule, stated = setup.q, setup.schedule, not is_arm(source) or bool(overrides)
    plant.reset(start, np.zeros(robot.nv))
    first = Connection(planner, start, seconds=seconds)
    with progress("first motion", 1.0) as advance:
        _move(first, planner, plant, sensors, schedule, advance)
    if first.fault is None and output is not None:
        first.save(output)
    facts = _facts(first, output if first.fault is None else None)
    answer(facts, as_json, _shown(first))
    if first.fault is not None:
        say(f"ended early: {first.fault}" + ("" if output is None else f"; {output} is not written"))
        if schedule.failing(planner.dt):
            say("note: joints fail in this scenario; --set faults=[] leaves that out")
        return ExitCode.STOPPED
    if stated and first.learned is None:
        say(IDEAL)
    for note in setup.notes:
        say(f"note: {note}")
    if not stated:
        say("note: a servo of 15 Hz without masses stood for the arm; a scenario says what is true of yours")
    if output is not None:
        say(f"{output}: estimates; a planner begins with them by drive.known")
    return ExitCode.DONE


def _setup(source: str, tip: str | None, overrides: list[str]) -> "Setup":
    """The run of a scenario; an arm alone, or a scenario without a path, is one with what is usual."""
    from ftqp.app.commands.inspection import MODELS, arm_of, is_arm, kind_of
    from ftqp.app.scenario import document
    from ftqp.app.scenario.setup import resolve, validated

    if is_arm(source):
        robot, _ = arm_of(source, tip)  # which says what is wrong with a model
        file = Path(source)
        given: dict[str, Any] = {"name": source}
        if file.suffix.lower() in MODELS:
            given = {kind_of(file): str(file.absolute()), "tips": list(robot.tips)}
        found = document.Document(name=robot.name, origin=source, folder=Path.cwd(), content={"robot": given})
    else:
        if tip is not None or not Path(source).is_file():
            arm_of(source, tip)  # which says so
        found = document.read(source)
    if "path" not in found.content:
        found.content.update({**_usual(), **found.content})
    document.overridden(found, overrides)
    return resolve(found, validated(found))


def _usual() -> dict[str, Any]:
    """What stands for an arm in simulation where nothing else is said."""
    from ftqp.sim.plants.joint_servo import BANDWIDTH

    servo = {"takes_velocity": False, "time_constant": 2.0 / BANDWIDTH}
    return {
        "planner": {"dt": DT, "drive": {"kind": "position", "takes_velocity": False}},
        "path": {"kind": "line", "displacement": [0.001, 0.0, 0.0], "duration": 1.0, "beyond_reach": True},
        "simulation": {"plant": "servo", "servo": servo},
    }


def _move(
    first: "Connection",
    planner: "Planner",
    plant: "Plant",
    sensors: "JointSensors | None",
    schedule: "Schedule",
    advance: Any,
) -> None:
    """The motion, with what fails on the way and is reported as in a run."""
    failing, announced = schedule.failing(planner.dt), schedule.announced(planner.dt)
    if sensors is not None:
        sensors.reset()
    tick = 0
    while not first.done:
        for event in failing.get(tick, ()):
            plant.fail(event.fault)
        for event in announced.get(tick, ()):
            planner.report(event.fault)
        q = plant.q
        if sensors is not None:
            sensors.measure(plant.q, plant.v, plant.motors)
            q = sensors.q
        plant.advance(first.step(q))
        tick += 1
        advance(first.progress)


def _facts(first: "Connection", file: Path | None) -> dict[str, Any]:
    """What ``--json`` prints."""
    learned = first.learned
    facts: dict[str, Any] = {} if learned is None else learned.facts()
    facts |= {
        "robot": first.planner.robot.name, "fault": first.fault, "notices": list(first.notices),
        "missing": list(first.missing),
    }  # fmt: skip
    return facts if file is None else {**facts, "file": str(file)}


def _shown(first: "Connection") -> Shown:
    """What a person reads."""
    from ftqp.control.drive.learned_servos import SURE, UNITS, hertz, with_error
    from ftqp.control.following.connection_words import SCATTERS
    from ftqp.faults.sight import TYPICAL

    learned, diagnosis = first.learned, first.planner.diagnosis
    sight = None if diagnosis is None else diagnosis.sight
    if learned is None or first.fault is not None:
        return list(first.missing)
    thousandth = " or ".join(sorted({UNITS[unit] for unit in learned.units}, reverse=True))
    rows = []
    for i, joint in enumerate(learned.joints):
        lag, error, known = float(learned.lag[i]), float(learned.lag_error[i]), bool(learned.is_known[i])
        cells = [with_error(1e3 * lag, 1e3 * error), f"{hertz(lag):.2g}" if lag > SURE * error else "-"]
        for value, spread in (
            (learned.droop, learned.droop_error), (learned.friction, learned.friction_error)
        ):  # fmt: skip
            cells.append(with_error(1e3 * float(value[i]), 1e3 * float(spread[i])))
        if sight is not None:
            after = sight.lock_after(i, TYPICAL)
            cells += [f"{1e3 * sight.least()[i]:.2g}", f"{1e3 * after:.0f}" if np.isfinite(after) else "-"]
        noise = f"{1e3 * float(learned.noise[i]):.2g}" if learned.noise[i] > SCATTERS else "0"
        rows.append((joint, *(cells if known else ["not known", *["-"] * (len(cells) - 1)]), noise))
    seen = () if sight is None else (f"noticed [{thousandth}]", "lock after [ms]")
    units = (f"{what} [{thousandth}]" for what in ("sag", "friction"))
    heads = ("joint", "lag [ms]", "servo [Hz]", *units, *seen, f"noise [{thousandth}]")
    title = f"{learned.robot}: estimates of its servos, with standard deviations"
    notices = list(first.notices) if sight is None else [NOTICED]
    return [Table(title, heads, rows, heads[1:]), *notices, *first.missing]
