"""The story for a newcomer: an arm loses a joint on its way and finishes; its twin, never told, does not."""

from pathlib import Path
from typing import Any

import numpy as np

from ftqp.app.output import words
from ftqp.app.output.console import ExitCode, answer, say, tell
from ftqp.app.run import runs
from ftqp.app.scenario.setup import load
from ftqp.core.errors import MissingPackage
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.log_parts import FILE_NAME

SCENARIO = "panda-circle"
NEVER, TWIN = "faults.0.announced=never", "never-told"
"""What makes the naive twin, and its folder within that of the run."""
CONTRAST = "contrast.png"


def tell_story(out: Path | None, *, as_json: bool) -> ExitCode:
    """Runs the bundled scenario, once told of the failure and once not, and tells what happened.

    Raises:
        InputError: The output folder exists.
    """
    folder = runs.free_folder(out, "demo")
    setup = load(SCENARIO)
    rate = 1.0 / setup.planner.dt
    say(
        f"{setup.robot.name} goes round a circle in {setup.path.duration:g} s, "
        f"with {rate:g} commands a second ..."
    )
    told = runs.run(setup, folder)
    if told.summary["interrupted"]:
        return _told(told, [words_of(told)], {}, as_json=as_json)
    say("and once more, with a planner that is never told of the failure ...")
    never = runs.run(load(SCENARIO, [NEVER]), folder / TWIN, drawn=False)
    if never.summary["interrupted"]:
        return _told(never, [words_of(never)], {}, as_json=as_json)
    log, twin = (load_log(place / FILE_NAME) for place in (folder, folder / TWIN))
    picture = _contrast(log, twin, folder / "figures" / CONTRAST)
    facts = {"never_told": never.summary, "contrast": None if picture is None else str(picture)}
    return _told(told, story(told, log, never, picture), facts, as_json=as_json)


def _told(run: runs.Run, lines: list[str], more: dict[str, Any], *, as_json: bool) -> ExitCode:
    """The end of the story, for a program or a person."""
    answer(run.summary | more, as_json, lambda: tell("\n".join(lines)))
    return run.exit_code


def words_of(run: runs.Run) -> str:
    """A run that came to no end."""
    return "\n".join(words.report(run.summary))


def _contrast(told: Log, never: Log, file: Path) -> Path | None:
    """The picture of both arms; None, after a note, when the package that draws it is missing."""
    try:
        from ftqp.viz.figures.naive_twin import draw_contrast
    except MissingPackage:  # said already, when the figures of the run were to be drawn
        return None
    (fault,) = told.metadata["faults"]
    title = f"{fault['joint']} locks: the same arm and planner, told of it and never told"
    return draw_contrast(told, never, file, title)


def story(told: runs.Run, log: Log, never: runs.Run, picture: Path | None) -> list[str]:
    """What happened with one lock, told and not, in plain words."""
    facts, twin = told.summary, never.summary
    (fault,) = facts["faults"]
    error, before = log["position_error"], log["t"] < fault["at"]
    joint, others = fault["joint"], len(log.metadata["joints"]) - 1
    limits = words.limits_sentence(facts["max_limit_violation"])
    return [
        f"At {fault['at']:g} s the brake of {joint} closed, and the other {others} joints took over.",
        f"Before, the tool strayed at most {words.length(float(np.max(error[before])))} from the circle, "
        f"afterwards at most {words.length(float(np.max(error[~before])))}.",
        f"Once at rest, the failed joint moved {facts['max_failed_joint_motion'][joint]:g} rad; {limits}; "
        f"the busiest joint used {100 * _busiest(log):.0f} % of its speed.",
        f"The task: {words.ending(facts)}; a command took {facts['step_time_us']['p50']:.1f} us to compute.",
        f"The same planner, never told of the lock: {words.ending(twin)}, "
        f"{words.length(twin['max_position_error'])} from where the tool should be.",
        "",
        *([] if picture is None else [f"Picture of both arms: {picture}"]),
        f"More pictures, log, summary: {told.folder}",
        f"One page of it all: ftqp report {told.folder} {never.folder}",
        "The live page, where you break the joints: ftqp view",
    ]


def _busiest(log: Log) -> float:
    """The largest share of its speed limit that a joint used."""
    top = np.array([np.inf if value is None else value for value in log.metadata["limits"]["v_max"]])
    return float(np.max(np.abs(log["v"]) / top))
