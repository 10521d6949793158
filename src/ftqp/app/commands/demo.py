"""The story for a newcomer, in parts: a brake, a box in the way, a goal that needs another way."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from ftqp.app.output import words
from ftqp.app.output.console import ExitCode, answer, say, tell
from ftqp.app.run import runs
from ftqp.app.scenario.setup import Setup, load
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, MissingPackage
from ftqp.core.pose import rotation_vector
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.log_writer import FILE_NAME
from ftqp.sim.rival import ResolvedRates, Ride, ride, strayed

SCENARIO = "panda-unannounced"
FINDS, OWN_REPORTED = "ftqp, not reported", "ftqp, reported at once"
RIVAL_NEVER, RIVAL_REPORTED = "damped resolved rates, not reported", "the same, reported at once"


@dataclass(frozen=True, slots=True, kw_only=True)
class StoryPart:
    """What a part of the story came to, in words and for a program."""

    lines: list[str]
    facts: Mapping[str, Any]
    exit_code: int = 0


def _run(setup: Setup, folder: Path) -> runs.Run:
    """A run to its end."""
    run = runs.run(setup, folder, drawn=False)
    if run.summary["interrupted"]:
        raise KeyboardInterrupt
    return run


def ridden(setup: Setup, reported: bool, duration: float | None = None) -> Ride:
    """The rival on the arm of a scenario, with its noise and brake, for so long, or as the path lasts [s]."""
    robot, dt = setup.robot, setup.planner.dt
    return ride(
        ResolvedRates(robot, dt), robot, setup.path, setup.q, dt=dt, plant=setup.plant, sensors=setup.sensors,
        schedule=setup.schedule, reported=reported, duration=duration,
    )  # fmt: skip


def errors_of(error: FloatArray, t: FloatArray, at: float) -> dict[str, float]:
    """Errors of one controller before and after a failure, and at the end [m]."""
    before = t < at
    return {
        "before": float(error[before].max()),
        "after": float(error[~before].max()),
        "end": float(error[-1]),
    }


AT_ONCE, FOLDER = "faults.0.announced=", "reported"
"""What reports it at once, and the folder of that run within the other's."""
PICTURE = "rivals.png"


def brake_story(folder: Path) -> StoryPart:
    """The bundled scenario, the lock reported or not, to ftqp and to a rival."""
    setup = load(SCENARIO)
    (event,) = setup.schedule
    say(
        f"{setup.robot.name} goes round a circle in {setup.path.duration:g} s, in physics: servos, gravity, "
        f"noisy encoders. At {event.at:g} s the brake of {event.fault.joint} closes, and nobody reports it "
        "..."
    )
    alone = _run(setup, folder)
    say("once more with the lock reported, and with damped resolved rates, not reported and reported ...")
    _run(load(SCENARIO, [AT_ONCE]), folder / FOLDER)
    rides = {name: ridden(setup, name == RIVAL_REPORTED) for name in (RIVAL_NEVER, RIVAL_REPORTED)}
    log = load_log(folder / FILE_NAME)
    errors = {
        FINDS: strayed(log),
        OWN_REPORTED: strayed(load_log(folder / FOLDER / FILE_NAME)),
        **{name: one.error for name, one in rides.items()},
    }
    table = {name: errors_of(error, log["t"], event.at) for name, error in errors.items()}
    runs.make_folder(folder / "figures")
    picture = _drawn(log, rides, folder / "figures" / PICTURE)
    facts = {**alone.summary, "beside": table, "picture": None if picture is None else str(picture)}
    return StoryPart(lines=_story(alone, log, table, picture), facts=facts, exit_code=int(alone.exit_code))


def _drawn(log: Log, rides: Mapping[str, Ride], file: Path) -> Path | None:
    """The picture; None, after a note, when the package that draws it is missing."""
    try:
        from ftqp.viz.figures.compared_runs import Rival, draw_rivals
    except MissingPackage as error:
        say(f"note: {error}")
        return None
    rivals = [Rival(name=name, q=one.q, tip=one.tip, error=one.error) for name, one in rides.items()]
    (fault,) = log.metadata["faults"]
    title = f"The brake of {fault['joint']} closes, and nobody announces it: a Panda in physics"
    return draw_rivals(log, FINDS, rivals, file, title)


def _story(
    run: runs.Run, log: Log, table: Mapping[str, Mapping[str, float]], picture: Path | None
) -> list[str]:
    """What happened, with what the rival does as well."""
    facts = run.summary
    (fault,) = facts["faults"]
    joint, others = fault["joint"], len(log.metadata["joints"]) - 1
    after = 1e3 * (fault["detected_at"] - fault["at"]) if fault["detected_at"] is not None else None
    noticed = "did not notice" if after is None else f"named it after {after:.0f} ms"
    rival, reported, own = table[RIVAL_NEVER], table[RIVAL_REPORTED], table[FINDS]
    width = max(map(len, table))
    better = "less than ftqp" if reported["after"] < table[OWN_REPORTED]["after"] else "no less than ftqp"
    return [
        f"At {fault['at']:g} s the brake of {joint} closed. Nobody reported it; the detector {noticed}, "
        f"and the remaining {others} joints took over.",
        f"The task: {words.ending(facts)}; {words.limits_sentence(facts['max_limit_violation'])}; the "
        f"busiest joint used {100 * _busiest(log):.0f} % of its speed; a command took "
        f"{facts['step_time_us']['p50']:.1f} us.",
        "",
        f"{'How far the tool strayed:':{width}}  before the lock   after it   at the end",
        *(
            f"{name:{width}}  {words.length(row['before']):>15}   {words.length(row['after']):>8}   "
            f"{words.length(row['end']):>10}"
            for name, row in table.items()
        ),
        "",
        "Damped resolved rates are what a good engineer writes without ftqp: measured joints are fed back,",
        "limits of speed and acceleration kept. If the lock is reported, they stray "
        f"{words.length(reported['after'])}, {better}:",
        "this lock needs nothing more. If not, they command the locked joint as if it worked, and stray "
        f"{rival['after'] / own['after']:.1f}",
        "times as far as ftqp, which detects it. All joints: docs/evidence/well-wired.md",
        "",
        *([] if picture is None else [f"Picture of the arms: {picture}"]),
        f"Log and summary: {run.folder}",
        f"One page of it all: ftqp report {run.folder} {run.folder / FOLDER}",
    ]


def _busiest(log: Log) -> float:
    """The largest share of its speed limit that a joint used."""
    top = np.array([np.inf if value is None else value for value in log.metadata["limits"]["v_max"]])
    return float(np.max(np.abs(log["v"]) / top))


BOX, KEPT = (
    'scene=[{kind="box", size=[0.12, 0.12, 0.12], place=[-0.2, -0.3, 0.5]}]',
    "clearance={keep=0.02, self_pairs=false}",
)
"""A box where the elbow comes to stand after the lock, and how far to keep off [m]."""
LOOKED_AT = 20
"""Every so many ticks it is measured how far an arm is from the box."""


def box_story(folder: Path) -> StoryPart:
    """A run that knows of the box, and a rival that does not."""
    setup = load(SCENARIO, [BOX, KEPT])
    (event,) = setup.schedule
    say("the same brake, and a box where the elbow goes after the lock ...")
    _run(setup, folder)
    log, rival = load_log(folder / FILE_NAME), ridden(setup, False)
    box = {
        FINDS: _beside_box(setup, log["t"], log["q"], strayed(log), event.at),
        RIVAL_NEVER: _beside_box(setup, rival.t, rival.q, rival.error, event.at),
    }
    keeps, pushes = box[FINDS], box[RIVAL_NEVER]
    ends = "and run into it" if pushes["nearest"] <= 0.0 else f"{words.length(pushes['nearest'])} from it"
    lines = [
        "With a box where the elbow goes after the lock, six joints cannot keep the tool's pose and pass it:",
        f"ftqp, not reported, stays {words.length(keeps['nearest'])} from it, as asked, strays "
        f"{words.length(keeps['after'])} and says so;",
        f"resolved rates know of no box, stray {words.length(pushes['after'])} {ends}.",
        f"Log and summary: {folder}",
    ]
    return StoryPart(lines=lines, facts={"box": box})


def _beside_box(setup: Setup, t: FloatArray, q: FloatArray, error: FloatArray, at: float) -> dict[str, float]:
    """Errors beside the box, and how near the arm truly came to it [m]; below 0 it ran into it."""
    distances = setup.planner.distances(q[::LOOKED_AT])
    return errors_of(error, t, at) | {"nearest": min(float(one.min()) for one in distances.values())}


START: Final = (-1.357, 1.367, -0.62, -1.33, 1.568, 1.828, -1.273)
"""Where the joints of a Panda begin [rad]."""
POSITION, ORIENTATION = (0.6, -0.068, 0.835), (0.197, 0.7611, 0.1018, 0.6096)
"""The goal of the tip [m], and its quaternion x, y, z, w. It is the first of the goals of
`benchmarks/peers_in_physics.py`, drawn at random, that six joints reach, but not straight on."""
JOINT, BRAKES_AT, DRIVEN, RESTS, PERIOD = "panda_joint1", 0.2, 9.7, 2.3, 0.002
"""Which joint's brake closes, and when; how long the straight way takes, and how long both may rest after it;
the sampling period [s]."""


def goal_story(folder: Path) -> StoryPart:
    """ftqp on its way to the goal, the lock not reported, and a rival that knows it and goes straight on."""
    setup = _across()
    say(f"and a goal across the workspace; the brake of {JOINT} closes soon after the start ...")
    leads = setup.simulation().run().q
    path, planner = setup.path, setup.planner
    rival = ridden(setup, True, duration=DRIVEN + RESTS)
    goal = path.sample(np.array([path.duration])).pose[0]
    own, straight = (_off(setup, q, goal) for q in (leads, rival.q[-1]))
    found = ", ".join(planner.faults) or "nothing"
    lines = [
        f"A goal across the workspace; the brake of {JOINT} closes {BRAKES_AT:g} s after the start. Six "
        "joints reach the goal, but not straight on:",
        f"ftqp, not reported, detects it ({found}), looks for another posture, goes there, and ends "
        f"{_ends(own)};",
        f"resolved rates, reported at once, go straight on and end {_ends(straight)}.",
        "A motion planner to which it is reported can find such a way, too. Eight such goals, with pink and "
        "placo:",
        "benchmarks/results/peers_in_physics.md",
    ]
    return StoryPart(lines=lines, facts={"goal": {FINDS: own, "resolved rates, reported": straight}})


def _across() -> Setup:
    """The scenario of the demo with another start, another brake and the goal in place of the circle."""
    goal = f'kind="point_to_point", position={list(POSITION)}, orientation={list(ORIENTATION)}'
    return load(
        SCENARIO,
        [
            f"planner.dt={PERIOD}", f"start.q={list(START)}", f"faults.0.joint={JOINT}",
            f"faults.0.at={BRAKES_AT}", f'path={{{goal}, duration={DRIVEN}, reference="goal"}}',
            f"simulation.duration={DRIVEN + RESTS - PERIOD}",
        ],
    )  # fmt: skip


def _ends(end: dict[str, float]) -> str:
    return f"{words.length(end['off'])} and {end['turned']:.1f} degrees off"


def _off(setup: Setup, q: FloatArray, goal: FloatArray) -> dict[str, float]:
    """How far the tip is from the goal [m, degrees]."""
    T = setup.robot.pose(q)
    turned = np.linalg.norm(rotation_vector(goal[:3, :3] @ T[:3, :3].T))
    return {"off": float(np.linalg.norm(T[:3, 3] - goal[:3, 3])), "turned": float(np.degrees(turned))}


PARTS: Final[Mapping[str, Callable[[Path], StoryPart]]] = {
    "brake": brake_story,
    "box": box_story,
    "goal": goal_story,
}
"""By what is asked for, in the order in which they are shown; the first one's folder is that of the demo, and
each other one's lies in it."""


def tell_story(parts: Sequence[str], out: Path | None, *, as_json: bool) -> ExitCode:
    """Plays parts of the story, all of them where none is named, and prints each as soon as it has ended."""
    unknown = [name for name in parts if name not in PARTS]
    if unknown:
        raise InputError(f"{unknown[0]!r} is no part of the demo; it has {', '.join(PARTS)}")
    chosen = [name for name in PARTS if name in parts or not parts]
    folder, facts, code = runs.free_folder(out, "demo"), dict[str, Any](), ExitCode.DONE
    ending = ["The live page, where you break the joints: ftqp view"] if chosen[-1] == list(PARTS)[-1] else []
    for name in chosen:
        played = PARTS[name](folder if name == next(iter(PARTS)) else folder / name)
        facts |= played.facts
        code = max(code, ExitCode(played.exit_code))
        if not as_json:
            tell("\n".join([*played.lines, ""]))
    answer(facts, as_json, ending)
    return code
