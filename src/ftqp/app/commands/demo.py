"""The story for a newcomer: a brake closes unannounced, the arm finishes, and what a good rival does.

Then the same with a box where the elbow goes after the lock.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.app.output import words
from ftqp.app.output.console import ExitCode, answer, say, tell
from ftqp.app.run import runs
from ftqp.app.scenario.setup import Setup, load
from ftqp.core.checks import FloatArray
from ftqp.core.errors import MissingPackage
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.log_parts import FILE_NAME
from ftqp.sim.rival.beside import Ride, ride, strayed
from ftqp.sim.rival.resolved_rates import ResolvedRates

SCENARIO = "panda-unannounced"
TOLD, FOLDER = "faults.0.announced=", "told"
"""What tells the planner at once, and the folder of that run within the other's."""
BOX, KEPT, BOX_FOLDER = (
    'scene=[{kind="box", size=[0.12, 0.12, 0.12], place=[-0.2, -0.3, 0.5]}]',
    "clearance={keep=0.02, self_pairs=false}",
    "box",
)
"""A box where the elbow comes to stand after the lock, how far to keep off [m], the folder of that run."""
LOOKED_AT = 20
"""Every so many ticks it is measured how far an arm is from the box."""
PICTURE = "rivals.png"
FINDS, OWN_TOLD = "ftqp, not told", "ftqp, told at once"
RIVAL_NEVER, RIVAL_TOLD = "damped resolved rates, not told", "the same, told at once"


def tell_story(out: Path | None, *, as_json: bool) -> ExitCode:
    """Runs the bundled scenario, a planner that is told, and a rival told and not; tells what happened.

    Raises:
        InputError: The output folder exists.
        ScenarioError: MuJoCo is not installed.
    """
    folder = runs.free_folder(out, "demo")
    setup = load(SCENARIO)
    (event,) = setup.schedule
    say(
        f"{setup.robot.name} goes round a circle in {setup.path.duration:g} s, in physics: servos, gravity, "
        f"noisy encoders. At {event.at:g} s the brake of {event.fault.joint} closes, and nobody says so ..."
    )
    alone = runs.run(setup, folder, drawn=False)
    if alone.summary["interrupted"]:
        return _told(alone, words.report(alone.summary), {}, as_json=as_json)
    say("once more with a planner that is told, and with damped resolved rates, not told and told ...")
    told = runs.run(load(SCENARIO, [TOLD]), folder / FOLDER, drawn=False)
    if told.summary["interrupted"]:
        return _told(told, words.report(told.summary), {}, as_json=as_json)
    rides = {name: _ridden(setup, name == RIVAL_TOLD) for name in (RIVAL_NEVER, RIVAL_TOLD)}
    log = load_log(folder / FILE_NAME)
    errors = {
        FINDS: strayed(log),
        OWN_TOLD: strayed(load_log(folder / FOLDER / FILE_NAME)),
        **{name: one.error for name, one in rides.items()},
    }
    table = {name: _facts(error, log["t"], event.at) for name, error in errors.items()}
    say("and with a box where the elbow goes after the lock ...")
    boxed = load(SCENARIO, [BOX, KEPT])
    kept = runs.run(boxed, folder / BOX_FOLDER, drawn=False)
    if kept.summary["interrupted"]:
        return _told(kept, words.report(kept.summary), {}, as_json=as_json)
    box = {
        FINDS: _beside_box(boxed, *_of_log(folder / BOX_FOLDER), event.at),
        RIVAL_NEVER: _beside_box(boxed, *_of_ride(_ridden(boxed, False)), event.at),
    }
    runs.make_folder(folder / "figures")
    picture = _drawn(log, rides, folder / "figures" / PICTURE)
    facts = {"beside": table, "box": box, "picture": None if picture is None else str(picture)}
    return _told(alone, story(alone, log, table, box, picture), facts, as_json=as_json)


def _of_log(folder: Path) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times, joints and true errors of a run."""
    log = load_log(folder / FILE_NAME)
    return log["t"], log["q"], strayed(log)


def _of_ride(done: Ride) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same of a rival."""
    return done.t, done.q, done.error


def _beside_box(setup: Setup, t: FloatArray, q: FloatArray, error: FloatArray, at: float) -> dict[str, float]:
    """Errors beside the box, and how near the arm truly came to it [m]; below 0 it ran into it."""
    near = min(min(setup.planner.distances(one).values()) for one in q[::LOOKED_AT])
    return _facts(error, t, at) | {"nearest": float(near)}


def _ridden(setup: Setup, told: bool) -> Ride:
    """The rival on the arm of the scenario, with the same noise and the same brake."""
    return ride(
        ResolvedRates(setup.robot, setup.planner.dt), setup.robot, setup.path, setup.q, dt=setup.planner.dt,
        plant=setup.plant, sensors=setup.sensors, schedule=setup.schedule, told=told,
    )  # fmt: skip


def _facts(error: FloatArray, t: FloatArray, at: float) -> dict[str, float]:
    """Errors of one controller [m]."""
    before = t < at
    return {
        "before": float(error[before].max()),
        "after": float(error[~before].max()),
        "end": float(error[-1]),
    }


def _told(run: runs.Run, lines: list[str], more: dict[str, Any], *, as_json: bool) -> ExitCode:
    """The end of the story, for a program or a person."""
    answer(run.summary | more, as_json, lambda: tell("\n".join(lines)))
    return run.exit_code


def _drawn(log: Log, rides: Mapping[str, Ride], file: Path) -> Path | None:
    """The picture; None, after a note, when the package that draws it is missing."""
    try:
        from ftqp.viz.figures.rivals import Rival, draw_rivals
    except MissingPackage:  # said already, when the figures of the run were to be drawn
        return None
    rivals = [Rival(name=name, q=one.q, tip=one.tip, error=one.error) for name, one in rides.items()]
    (fault,) = log.metadata["faults"]
    title = f"The brake of {fault['joint']} closes, and nobody announces it: a Panda in physics"
    return draw_rivals(log, FINDS, rivals, file, title)


def story(
    run: runs.Run,
    log: Log,
    table: Mapping[str, Mapping[str, float]],
    box: Mapping[str, Mapping[str, float]],
    picture: Path | None,
) -> list[str]:
    """What happened, in plain words, with what the rival does as well."""
    facts = run.summary
    (fault,) = facts["faults"]
    joint, others = fault["joint"], len(log.metadata["joints"]) - 1
    after = 1e3 * (fault["detected_at"] - fault["at"]) if fault["detected_at"] is not None else None
    noticed = "did not find out" if after is None else f"found it out after {after:.0f} ms"
    rival, told, own = table[RIVAL_NEVER], table[RIVAL_TOLD], table[FINDS]
    width = max(map(len, table))
    keeps, pushes = box[FINDS], box[RIVAL_NEVER]
    ends = "and run into it" if pushes["nearest"] <= 0.0 else f"{words.length(pushes['nearest'])} from it"
    better = "less than ftqp" if told["after"] < table[OWN_TOLD]["after"] else "no less than ftqp"
    return [
        f"At {fault['at']:g} s the brake of {joint} closed. Nobody told the planner; its detector {noticed}, "
        f"and the other {others} joints took over.",
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
        f"limits of speed and acceleration kept. Told of the lock, they stray {words.length(told['after'])}, "
        f"{better}:",
        "this lock needs nothing more. Not told, they lead the dead joint as if it worked, and stray "
        f"{rival['after'] / own['after']:.1f}",
        "times as far as ftqp, which finds out by itself. All joints: docs/evidence/well-wired.md",
        "",
        "With a box where the elbow goes after the lock, six joints cannot keep the tool's pose and pass it:",
        f"ftqp, not told, stays {words.length(keeps['nearest'])} from it, as asked, strays "
        f"{words.length(keeps['after'])} and says so;",
        f"resolved rates know of no box, stray {words.length(pushes['after'])} {ends}.",
        "The same beside pink and placo: benchmarks/results/peers_in_physics.md",
        "",
        *([] if picture is None else [f"Picture of the arms: {picture}"]),
        f"Log and summary: {run.folder}",
        f"One page of it all: ftqp report {run.folder} {run.folder / FOLDER}",
        "The live page, where you break the joints: ftqp view",
    ]


def _busiest(log: Log) -> float:
    """The largest share of its speed limit that a joint used."""
    top = np.array([np.inf if value is None else value for value in log.metadata["limits"]["v_max"]])
    return float(np.max(np.abs(log["v"]) / top))
