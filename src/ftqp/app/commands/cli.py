"""The command line: ``ftqp demo, run, replay, compare, check, inspect``, analyses, tables."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from ftqp import __version__
from ftqp.app.commands.analyses import ANALYSES, campaign, tell_bundled
from ftqp.app.commands.building import build
from ftqp.app.commands.connecting import connect
from ftqp.app.commands.exporting import export
from ftqp.app.commands.identifying import identify
from ftqp.app.output.console import ExitCode, answer, command, say, tell, tell_json, tell_rows, tell_text
from ftqp.core.errors import FtqpError

app = typer.Typer(
    name="ftqp",
    help="Fault-tolerant motion planning: an arm keeps its task through a joint failure.",
    epilog="Start with: ftqp demo",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main() -> None:
    """The program ``ftqp``."""
    if sys.stdout is None:
        say("error: standard output is closed, expected one for results; open it, for example by: > FILE")
        sys.exit(ExitCode.BAD_INPUT)
    try:
        app()
    except KeyboardInterrupt:
        say("interrupted")
        sys.exit(ExitCode.INTERRUPTED)
    except FtqpError as error:
        say(f"error: {error}")
        sys.exit(ExitCode.BAD_INPUT)


def _version(wanted: bool) -> None:
    if wanted:
        tell(f"ftqp {__version__}")
        raise typer.Exit


@app.callback()
def _program(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    pass


@app.command(epilog="Example: ftqp demo --out pictures")
@command
def demo(parts: list[str] | None = None, out: Path | None = None, as_json: bool = False) -> ExitCode:
    """Tell the story: a Panda loses a joint and goes on; then beside a box, and to a goal by another way.

    Options:
        parts [PART]...: brake, box or goal; all of them if left out.
    """
    from ftqp.app.commands import demo as story

    return story.tell_story(parts or [], out, as_json=as_json)


@app.command(epilog="Example: ftqp run panda-circle --backend daqp --set faults.0.at=5.0")
@command
def run(
    scenario: str,
    backend: str | None = None,
    scheme: str | None = None,
    overrides: list[str] | None = None,
    out: Path | None = None,
    record: Path | None = None,
    plan: Path | None = None,
    no_figures: bool = False,
    as_json: bool = False,
) -> ExitCode:
    """Run a scenario; writes summary.json, log.npy and figures.

    Options:
        record --record-qps FILE: A new .npz file for the QPs of the run.
    """
    from ftqp.app.output import words
    from ftqp.app.run import runs
    from ftqp.app.scenario.setup import load

    folder = runs.free_folder(out, Path(scenario).stem)
    record = runs.free_recording(record, folder)
    setup = load(
        scenario, overrides or (), backend=backend, scheme=scheme, record=record is not None, plan=plan
    )
    for note in setup.notes:
        say(f"note: {note}")
    result = runs.run(setup, folder, record, drawn=not no_figures)
    answer(result.summary, as_json, words.report(result.summary))
    return result.exit_code


@app.command(epilog="Example: ftqp replay qps.npz --tick 1500 --backend osqp")
@command
def replay(
    file: Path,
    tick: int | None = None,
    backend: str | None = None,
    others: str | None = None,
    as_json: bool = False,
) -> ExitCode:
    """Solve a recorded QP again and explain the answer: active bounds, multipliers, who disagrees.

    Options:
        file FILE: A recording, made by ftqp run --record-qps FILE.
        tick --tick K: Tick of the run; without it, say what was recorded.
        backend --backend NAME: Whose answer to explain; that of the run if left out.
        others --backends A,B,C: Whose answers to compare; all if left out.
    """
    from ftqp.app.replay import explanation
    from ftqp.app.replay import replayed as again
    from ftqp.qp.recording.recorded_qps import Recording

    recording = Recording.load(file)
    if tick is None:
        facts = again.overview(file, recording)
    else:
        names = None if others is None else [name.strip() for name in others.split(",") if name.strip()]
        facts = again.replay(file, recording, tick, backend, names)
    answer(facts, as_json, (explanation.overview if tick is None else explanation.replay)(facts))
    unsolved = tick is not None and facts["solution"]["status"] in ("MAX_ITERATIONS", "FAILED")
    return ExitCode.STOPPED if unsolved else ExitCode.DONE


@app.command(epilog="Example: ftqp compare panda-circle --backends active_set,daqp --schemes mvn,mke")
@command
def compare(
    scenarios: list[str],
    backends: str | None = None,
    schemes: str | None = None,
    overrides: list[str] | None = None,
    out: Path | None = None,
    no_figures: bool = False,
    as_json: bool = False,
) -> ExitCode:
    """Run scenarios under several schemes and backends; writes a table, figures and every run.

    Options:
        scenarios SCENARIO...: Scenario files, or names of bundled ones.
        backends --backends A,B,...: QP backends or profile files, in place of the scenario's.
        schemes --schemes X,Y,...: Schemes, in place of the scenario's.
        out --out DIR: Folder to make; runs/compare-<time> if left out.
    """
    from ftqp.app.compare import comparison
    from ftqp.app.compare.combinations import combinations
    from ftqp.app.run import runs

    folder = runs.free_folder(out, "compare")
    combined = combinations(scenarios, overrides or (), backends=backends, schemes=schemes)
    result = comparison.compare(combined, folder, drawn=not no_figures)
    answer({"runs": result.rows}, as_json, result.summary())
    return result.exit_code


@app.command(epilog="Example: ftqp check my-scenario.toml --set planner.dt=0.002")
@command
def check(
    scenario: str | None = None,
    backend: str | None = None,
    scheme: str | None = None,
    overrides: list[str] | None = None,
    keys: bool = False,
    as_json: bool = False,
) -> ExitCode:
    """Validate a scenario and print it with every default filled in; without one, list the bundled ones.

    Options:
        scenario [SCENARIO]: A scenario file, or the name of a bundled one.
        keys --keys: Print every key a scenario can have.
    """
    if keys:
        from ftqp.app.output import tables

        return tell_rows("keys", "Keys of a scenario", tables.keys(), as_json)
    if scenario is None:
        return tell_bundled("scenario", "scenarios", as_json)
    from ftqp.app.output.words import late_sentence
    from ftqp.app.scenario.setup import load

    setup = load(scenario, overrides or (), backend=backend, scheme=scheme)
    facts = {"scenario": setup.name, "valid": True, "resolved": setup.content}
    if as_json:
        tell_json(facts)
    else:
        tell_text(setup.toml)
    for note in (*(f"{setup.robot.name}: {finding}" for finding in setup.robot.findings), *setup.notes):
        say(f"note: {note}")
    end = setup.path.duration if setup.duration is None else setup.duration
    for event in setup.schedule.events:
        if event.at > end:
            slower = setup.duration is None
            say(f"warning: {late_sentence(str(event.fault.joint), event.at, end, may_take_longer=slower)}")
    say(f"{setup.name} is valid")
    return ExitCode.DONE


@app.command(epilog="Example: ftqp inspect arm.urdf --tip tool0")
@command
def inspect(
    source: str,
    tip: str | None = None,
    locked: str | None = None,
    out: Path | None = None,
    survival: bool = False,
    capsules: bool = False,
    no_figures: bool = False,
    as_json: bool = False,
) -> ExitCode:
    """Say what was read of an arm: limits, findings, margins, which joints it can lose; draws it.

    Options:
        source FILE|ROBOT: A URDF or MJCF file, or a robot of the catalog.
        tip --tip FRAME,...: The controlled frame, or several; the only end if left out.
        locked --locked A,B,...: Joints to hold; those on the way to no tip are held anyway.
        out --out DIR: Folder to make; runs/inspect-<name>-<time> if left out.
        survival --survival: Say at which share of its workspace it can lose each joint.
        capsules --capsules: List its bodies, as they are kept clear of a scene.
    """
    from ftqp.app.commands import inspection
    from ftqp.app.run.runs import free_folder

    tips, held = (
        [name.strip() for name in (given or "").split(",") if name.strip()] for given in (tip, locked)
    )
    folder = None if no_figures else free_folder(out, f"inspect-{Path(source).stem}")
    return inspection.inspect(
        source, tips, held, folder, as_json=as_json, survival=survival, capsules=capsules
    )


@app.command(epilog="Example: ftqp report runs/circle runs/circle-daqp -o circle.html")
@command
def report(
    results: list[Path], output: Path = Path("report.html"), full: bool = False, as_json: bool = False
) -> ExitCode:
    """Tell what happened in runs on one page that opens offline: words, numbers, figures, a 3-D replay.

    Options:
        results RUN...: Folders of runs, coverage results or campaigns.
        output -o --output FILE: The page to make.
        full --full: Replay every picture of a run that is longer than a minute.
    """
    from ftqp.app.commands import reporting

    return reporting.report(results, output, full=full, as_json=as_json)


for body, example in ANALYSES.items():
    app.command(epilog=example)(command(body))


@app.command(epilog="Example: ftqp view panda-circle --port 8080")
@command
def view(
    source: str | None = None,
    backend: str | None = None,
    scheme: str | None = None,
    overrides: list[str] | None = None,
    plan: Path | None = None,
    host: str = "127.0.0.1",
    port: int = 8080,
    speed: float = 1.0,
    no_browser: bool = False,
    record: Path | None = None,
    no_rival: bool = False,
    meshes: str = "collision",
    as_json: bool = False,
) -> ExitCode:
    """Open a page where an arm moves and a click breaks a joint; replay a run, or a failure of a report.

    Options:
        source [SCENARIO|RUN|COVERAGE]: A scenario, or the folder of a run or coverage report; a Panda in
            physics if left out.
        host --host ADDRESS: Where to listen; others than this machine see the page.
        port --port N: The port; if it is in use, the next free one.
        speed --speed X: Simulated seconds in a second.
        no_browser --no-browser: Open no browser.
        record --record FILE: A new .html file for a recording, written at the end.
        no_rival --no-rival: Leave out the arm that damped resolved rates lead.
        meshes --meshes KIND: Meshes of a URDF that are drawn: collision, visual or none.
    """
    from ftqp.app.commands import viewing
    from ftqp.sim.session.session_arms import Choice

    scenario, usual = viewing.usual() if source is None else (source, ())
    choice = Choice(
        scenario=scenario,
        overrides=(*usual, *(overrides or ())),
        plan=None if plan is None else str(plan),
        scheme=scheme,
        backend=backend,
    )
    return viewing.view(
        choice, host=host, port=port, speed=speed, browser=not no_browser, record=record, rival=not no_rival,
        meshes=meshes, as_json=as_json,
    )  # fmt: skip


app.command(epilog="Example: ftqp connect panda-mujoco-brake --set faults=[] -o arm.json")(command(connect))
app.command(epilog="Example: ftqp campaign safety --episodes 1000 --table --out runs/safe")(command(campaign))
app.command(epilog="Example: ftqp build panda-circle --target aarch64 -o panda-arm64")(command(build))
app.command(epilog="Example: ftqp identify --motion panda-mujoco-payload -o motion.csv --rehearse log.csv")(
    command(identify)
)
app.command(epilog="Example: ftqp export runs/panda-circle --format mcap -o panda-bag")(command(export))


@app.command(epilog="Example: ftqp doctor --json")
@command
def doctor(as_json: bool = False) -> ExitCode:
    """Say whether this installation is sound: kernel, processor, versions, and what is missing."""
    from ftqp.app.commands import doctor

    return doctor.examine(as_json=as_json)


@app.command(epilog="Example: ftqp robots --json")
@command
def robots(as_json: bool = False) -> ExitCode:
    """List the robots of the catalog."""
    from ftqp.app.output import tables

    return tell_rows("robots", "Robots", tables.robots(), as_json)


@app.command(epilog="Example: ftqp backends")
@command
def backends(as_json: bool = False) -> ExitCode:
    """List the QP backends: licences, what is missing and how to install it."""
    from ftqp.app.output import tables

    return tell_rows("backends", "QP backends", tables.backends(), as_json)


@app.command(epilog="Example: ftqp schemes")
@command
def schemes(as_json: bool = False) -> ExitCode:
    """List the schemes: what each minimises, and its gains."""
    from ftqp.app.output import tables

    return tell_rows("schemes", "Schemes", tables.schemes(), as_json)
