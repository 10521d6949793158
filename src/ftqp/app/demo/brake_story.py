"""A brake closes unannounced, the arm finishes its circle, and what a good rival does."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ftqp.app.demo.story_part import (
    FINDS,
    OWN_TOLD,
    RIVAL_NEVER,
    RIVAL_TOLD,
    SCENARIO,
    StoryPart,
    errors_of,
    ridden,
)
from ftqp.app.output import words
from ftqp.app.output.console import say
from ftqp.app.run import runs
from ftqp.app.scenario.setup import load
from ftqp.core.errors import MissingPackage
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.log_writer import FILE_NAME
from ftqp.sim.rival import Ride, strayed

TOLD, FOLDER = "faults.0.announced=", "told"
"""What tells the planner at once, and the folder of that run within the other's."""
PICTURE = "rivals.png"


def brake_story(folder: Path) -> StoryPart:
    """The bundled scenario, a planner that is told, and a rival told and not."""
    setup = load(SCENARIO)
    (event,) = setup.schedule
    say(
        f"{setup.robot.name} goes round a circle in {setup.path.duration:g} s, in physics: servos, gravity, "
        f"noisy encoders. At {event.at:g} s the brake of {event.fault.joint} closes, and nobody says so ..."
    )
    alone = runs.run(setup, folder, drawn=False)
    if alone.summary["interrupted"]:
        return _broken_off(alone)
    say("once more with a planner that is told, and with damped resolved rates, not told and told ...")
    told = runs.run(load(SCENARIO, [TOLD]), folder / FOLDER, drawn=False)
    if told.summary["interrupted"]:
        return _broken_off(told)
    rides = {name: ridden(setup, name == RIVAL_TOLD) for name in (RIVAL_NEVER, RIVAL_TOLD)}
    log = load_log(folder / FILE_NAME)
    errors = {
        FINDS: strayed(log),
        OWN_TOLD: strayed(load_log(folder / FOLDER / FILE_NAME)),
        **{name: one.error for name, one in rides.items()},
    }
    table = {name: errors_of(error, log["t"], event.at) for name, error in errors.items()}
    runs.make_folder(folder / "figures")
    picture = _drawn(log, rides, folder / "figures" / PICTURE)
    facts = {**alone.summary, "beside": table, "picture": None if picture is None else str(picture)}
    return StoryPart(lines=_story(alone, log, table, picture), facts=facts, exit_code=int(alone.exit_code))


def _broken_off(run: runs.Run) -> StoryPart:
    return StoryPart(
        lines=words.report(run.summary), facts=run.summary, exit_code=int(run.exit_code), whole=False
    )


def _drawn(log: Log, rides: Mapping[str, Ride], file: Path) -> Path | None:
    """The picture; None, after a note, when the package that draws it is missing."""
    try:
        from ftqp.viz.figures.rivals import Rival, draw_rivals
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
    noticed = "did not find out" if after is None else f"found it out after {after:.0f} ms"
    rival, told, own = table[RIVAL_NEVER], table[RIVAL_TOLD], table[FINDS]
    width = max(map(len, table))
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
        *([] if picture is None else [f"Picture of the arms: {picture}"]),
        f"Log and summary: {run.folder}",
        f"One page of it all: ftqp report {run.folder} {run.folder / FOLDER}",
    ]


def _busiest(log: Log) -> float:
    """The largest share of its speed limit that a joint used."""
    top = np.array([np.inf if value is None else value for value in log.metadata["limits"]["v_max"]])
    return float(np.max(np.abs(log["v"]) / top))
