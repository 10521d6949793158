"""The story for a newcomer: an arm loses a joint on its way and finishes, told in plain words."""

from pathlib import Path

import numpy as np

from ftqp.app.output import words
from ftqp.app.output.console import ExitCode, say, tell, tell_json
from ftqp.app.run import runs
from ftqp.app.scenario.setup import load
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_file import FILE_NAME, load_log

SCENARIO = "panda-circle"


def tell_story(out: Path | None, *, as_json: bool) -> ExitCode:
    """Runs the bundled scenario and tells what happened.

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
    result = runs.run(setup, folder)
    if as_json:
        tell_json(result.summary)
    elif result.summary["interrupted"]:
        tell("\n".join(words.report(result.summary)))
    else:
        tell("\n".join(story(result, load_log(folder / FILE_NAME))))
    return result.exit_code


def story(result: runs.Run, log: Log) -> list[str]:
    """What happened in a run with one lock, in plain words."""
    facts = result.summary
    (fault,) = facts["faults"]
    error, before = log["position_error"], log["t"] < fault["at"]
    joint, others = fault["joint"], len(log.metadata["joints"]) - 1
    limits = words.limits_sentence(facts["max_limit_violation"])
    return [
        f"At {fault['at']:g} s the brake of {joint} closed, and the other {others} joints took over.",
        f"Before, the tool strayed at most {words.length(float(np.max(error[before])))} from the circle, "
        f"afterwards at most {words.length(float(np.max(error[~before])))}.",
        f"Once at rest, the failed joint moved {facts['max_failed_joint_motion'][joint]:g} rad.",
        f"In all that, {limits}; the busiest joint used {100 * _busiest(log):.0f} % of its speed.",
        f"The task: {words.ending(facts)}; a command took {facts['step_time_us']['p50']:.1f} us to compute.",
        "",
        f"Log and summary: {result.folder}",
        *(f"Picture: {figure}" for figure in result.figures),
        "Next: ftqp run planar6-stop, ftqp check panda-circle, ftqp --help",
    ]


def _busiest(log: Log) -> float:
    """The largest share of its speed limit that a joint used."""
    top = np.array([np.inf if value is None else value for value in log.metadata["limits"]["v_max"]])
    return float(np.max(np.abs(log["v"]) / top))
