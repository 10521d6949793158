"""What every consumer of faults makes of one of a kind that nobody wrote a case for."""

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from typer.testing import CliRunner

import ftqp
from ftqp.app.campaign.episode_study import load_campaign
from ftqp.app.campaign.shown_trace import failures
from ftqp.app.commands.cli import app
from ftqp.app.output.words import fault_sentence
from ftqp.app.scenario.setup import load
from ftqp.app.view.live_source import arms_of
from ftqp.app.view.replay_source import ReplaySource
from ftqp.core.errors import FtqpError
from ftqp.sim.export.run_bag import step_definition
from ftqp.sim.log.description import described
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.metrics import summary
from ftqp.sim.log.signals import CONDITIONS
from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.plants.mujoco_plant import MujocoPlant
from ftqp.sim.plants.servo_plant import ServoPlant
from ftqp.sim.session.live_session import Session
from ftqp.sim.session.session_arms import Choice
from ftqp.sim.session.session_commands import Break, Play, Seek
from ftqp.viz.figures.run_figures import CONDITION_COLOURS, save_figures
from ftqp.viz.live import colours
from ftqp.viz.live.colours import legend
from ftqp.viz.live.panel import ACTIONS
from ftqp.viz.live.plots import joint_table

DT, JOINT = 0.01, "j2"
ROBOT = ftqp.robots.load("planar6")
PATH = ftqp.paths.Line(ROBOT.pose(ROBOT.neutral), (0.01, 0.0, 0.0), duration=0.1)
SCENARIO = """
[robot]
name = "planar6"
[planner]
dt = 0.01
[path]
kind = "line"
displacement = [0.01, 0.0, 0.0]
duration = 0.1
[[faults]]
kind = "sticky"
joint = "j2"
at = 0.05
announced = "never"
"""


def planner() -> ftqp.Planner:
    return ftqp.Planner(ROBOT, DT)


def simulated(fault: Any) -> Any:
    return ftqp.Simulation(
        planner(), PATH, q=ROBOT.neutral, log="memory",
        schedule=ftqp.Schedule([ftqp.FaultEvent(0.05, fault, "never")]),
    ).run()  # fmt: skip


def rollout(fault: Any) -> Any:
    samples = PATH.sample(DT * np.arange(10))
    targets = ftqp.Targets(samples.pose, samples.twist)
    return ftqp.batch.rollout(planner(), ROBOT.neutral, targets=targets, faults=[(fault, 3)])


def broken(order: Any) -> str:
    session = Session(
        lambda wish: arms_of(wish, rival=False), Choice(scenario="planar3-line", overrides=("faults=",))
    )
    session.put(order)
    session.advance(0.05)
    assert not session.frame.truth.any() and not session.frame.belief.any()
    return str(session.frame.message)


def said_by(*arguments: str) -> str:
    done = CliRunner().invoke(app, list(arguments))
    assert done.exit_code != 0 and "Traceback" not in done.output, done.output
    assert done.exception is None or isinstance(done.exception, SystemExit), repr(done.exception)
    return str(done.output + (done.stderr if done.stderr_bytes else ""))


def campaign_of(folder: Path) -> Path:
    file = folder / "campaign.toml"
    scenario = SCENARIO.replace("[[faults]]", "[[scenario.faults]]")
    for table in ("robot", "planner", "path"):
        scenario = scenario.replace(f"[{table}]", f"[scenario.{table}]")
    file.write_text(f"[campaign]\nepisodes = 2\nseed = 1\n{scenario}\n[vary]\n'planner.dt' = [0.01]\n")
    return file


def log_with(number: int, **said: Any) -> Log:
    """A run with a lock, as if the joint had that number and its fault was another."""
    event = ftqp.FaultEvent(0.05, ftqp.Locked(JOINT), "never")
    log = ftqp.Simulation(
        planner(), PATH, q=ROBOT.neutral, log="memory", schedule=ftqp.Schedule([event])
    ).run().log  # fmt: skip
    signals = {name: log[name] for name in log.names}
    truth = signals[f"truth.{JOINT}"].copy()
    truth[truth == ftqp.Locked.number] = number
    signals[f"truth.{JOINT}"] = truth
    facts = {**log.metadata, "faults": [{**log.metadata["faults"][0], **said}]}
    return Log(None, signals, log.units, log.descriptions, facts)


def shown(folder: Path, fault: Any) -> dict[str, Any]:
    """What is made of the table alone."""
    log = log_with(fault.number, kind="sticky", grip=1.0)
    replay = ReplaySource(log, "run", clock=lambda: 0.0)
    replay.put(Seek(0.08))
    frame = replay.frame()
    return {
        "described": described(ftqp.FaultEvent(0.05, fault, "never"), ROBOT),
        "words": fault_sentence(log.metadata["faults"][0]),
        "moved": JOINT in summary(log)["max_failed_joint_motion"],
        "figures": all(file.stat().st_size for file in save_figures(log, folder)),
        "page": "sticky" in joint_table(frame, ROBOT.joints),
        "condition": CONDITIONS[fault.number],
        "legend": "sticky joint" in legend(),
        "button": ACTIONS["stick"],
        "colours": [
            CONDITION_COLOURS[fault.number],
            colours.hexadecimal(colours.joint_colour(fault.number, False, False)),
        ],
        "bag": f"JOINT_STICKY={fault.number}" in step_definition(),
    }


EXACT = SimpleNamespace(simulation=SimpleNamespace(plant="kinematic"))


def main(folder: Path, kind: Any, registered: bool) -> None:
    """Print what each says.

    Args:
        folder: For files.
        kind: The class of the fault.
        registered: Whether it is in the table of kinds.
    """
    fault = kind(JOINT)
    file = folder / "sticks.toml"
    file.write_text(SCENARIO)
    coverage = ftqp.robots.load("planar", count=3)
    motion = np.tile(coverage.neutral, (3, 1))
    hold = ftqp.paths.Hold(coverage.pose(coverage.neutral), duration=0.02)
    campaign = str(campaign_of(folder))
    strange = log_with(9)
    consumers: dict[str, Callable[[], Any]] = {
        "planner": lambda: planner().report(fault),
        "batch": lambda: rollout(fault),
        "kinematic plant": lambda: KinematicPlant(ROBOT, DT).fail(fault),
        "servo plant": lambda: ServoPlant(ROBOT, DT).fail(fault),
        "mujoco plant": lambda: MujocoPlant(ftqp.robots.load("iiwa14"), DT).fail(kind(1)),
        "simulation": lambda: simulated(fault),
        "scenario": lambda: load(str(file)),
        "campaign": lambda: load_campaign(campaign),
        "coverage": lambda: ftqp.analysis.coverage(coverage, hold, motion, fault="sticky"),
        "replay": lambda: ReplaySource(strange, "run"),
        "figures": lambda: save_figures(strange, folder / "strange"),
        "summary": lambda: summary(strange),
    }
    found: dict[str, Any] = {}
    for name, consume in consumers.items():
        try:
            consume()
        except FtqpError as error:
            found[name] = str(error)
        except Exception as error:  # what a consumer must not do is told as well
            found[name] = f"RAISED {type(error).__name__}: {error}"
        else:
            found[name] = "SILENT"
    found["session"] = broken(Break("j1", "sticky"))
    found["session that plays"] = broken(Play("j1", 0.02, "sticky"))
    found["ftqp run"] = said_by("run", str(file), "--out", str(folder / "run"))
    found["ftqp compare"] = said_by("compare", str(file), "--schemes", "mvn,man", "--out", str(folder / "c"))
    found["ftqp campaign"] = said_by("campaign", campaign, "--out", str(folder / "campaign"))
    if registered:
        event = ftqp.FaultEvent(0.05, fault, "never")
        try:
            failures(SimpleNamespace(schedule=[event], robot=ROBOT, tables=EXACT))  # type: ignore[arg-type]
        except FtqpError as error:
            found["checker"] = str(error)
        found["shown"] = shown(folder, fault)
    print(json.dumps(found))
