"""The same brake, with a box where the elbow goes after the lock."""

from pathlib import Path

from ftqp.app.demo.story_part import FINDS, RIVAL_NEVER, SCENARIO, StoryPart, errors_of, ridden
from ftqp.app.output import words
from ftqp.app.output.console import say
from ftqp.app.run import runs
from ftqp.app.scenario.setup import Setup, load
from ftqp.core.checks import FloatArray
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.log_writer import FILE_NAME
from ftqp.sim.rival import strayed

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
    run = runs.run(setup, folder, drawn=False)
    if run.summary["interrupted"]:
        return StoryPart(
            lines=words.report(run.summary), facts=run.summary, exit_code=int(run.exit_code), whole=False
        )
    log, rival = load_log(folder / FILE_NAME), ridden(setup, False)
    box = {
        FINDS: _beside_box(setup, log["t"], log["q"], strayed(log), event.at),
        RIVAL_NEVER: _beside_box(setup, rival.t, rival.q, rival.error, event.at),
    }
    keeps, pushes = box[FINDS], box[RIVAL_NEVER]
    ends = "and run into it" if pushes["nearest"] <= 0.0 else f"{words.length(pushes['nearest'])} from it"
    lines = [
        "With a box where the elbow goes after the lock, six joints cannot keep the tool's pose and pass it:",
        f"ftqp, not told, stays {words.length(keeps['nearest'])} from it, as asked, strays "
        f"{words.length(keeps['after'])} and says so;",
        f"resolved rates know of no box, stray {words.length(pushes['after'])} {ends}.",
        f"Log and summary: {folder}",
    ]
    return StoryPart(lines=lines, facts={"box": box})


def _beside_box(setup: Setup, t: FloatArray, q: FloatArray, error: FloatArray, at: float) -> dict[str, float]:
    """Errors beside the box, and how near the arm truly came to it [m]; below 0 it ran into it."""
    distances = setup.planner.distances(q[::LOOKED_AT])
    return errors_of(error, t, at) | {"nearest": min(float(one.min()) for one in distances.values())}
