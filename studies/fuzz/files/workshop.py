"""Whole files, made once a process, of which spoiled ones are made: a run, a plan, results, verdicts."""

import atexit
import shutil
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

import ftqp
from ftqp.analysis.planning.fault_plan import plan_of
from ftqp.app.campaign.campaign_summary import summary
from ftqp.app.campaign.episode_study import COLUMNS, KIND, EpisodeWork, load_campaign
from ftqp.app.output.console import json_text
from ftqp.app.run import runs
from ftqp.app.run.healthy_motion import healthy_motion
from ftqp.app.scenario.setup import load
from ftqp.app.study.results_file import ResultsFile
from ftqp.app.view.verdicts_file import write_verdicts
from ftqp.faults.detection.calibration import Calibration
from ftqp.kernel.layout.enums import Residual
from ftqp.qp import QP, solve

SCENARIO = "planar3-line"
RUN, PLAN, CAMPAIGN, COVERAGE, CALIBRATION = "run", "plan.npz", "campaign", "coverage", "calibration.json"
HEALTHY = ("faults=", "path.duration=0.5", "path.displacement=[-0.01, 0.0, 0.0]")
"""What makes a short motion of the scenario, without failures."""
KEY = "of this very campaign"


@cache
def workshop() -> Path:
    """The folder."""
    folder = Path(tempfile.mkdtemp(prefix="ftqp-fuzz-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    runs.run(load(SCENARIO, ["simulation.duration=0.2", "faults.0.at=0.1"]), folder / RUN, drawn=False)
    setup = load(SCENARIO, HEALTHY)
    task, q = healthy_motion(setup)
    plan_of(task, q, coverage=0.5, stride=20, method="dp", settings={}).save(folder / PLAN)
    report = ftqp.analysis.coverage(setup.robot, task, q, stride=20, lock="instant")
    (folder / COVERAGE).mkdir()
    write_verdicts(folder / COVERAGE, report, setup.name, setup.toml, None)
    _campaign(folder / CAMPAIGN)
    _calibration(folder / CALIBRATION)
    solve(QP(np.eye(2), np.ones(2)), "dtrnn")  # compiled here, which is no matter of a file
    return folder


def _campaign(folder: Path) -> None:
    """Three episodes, and what is said of them."""
    made = load_campaign("safety", ["campaign.episodes=3", "scenario.path.duration=0.2"])
    rows = EpisodeWork(campaign=made)(range(3))
    with ResultsFile(folder, kind=KIND, key=KEY, columns=COLUMNS) as results:
        results.write([0, 1, 2], rows, 1.0, "me")
        results.crash([3], "it died")
    names = ("episode", *COLUMNS)
    facts = summary("safety", [dict(zip(names, (k, *row), strict=True)) for k, row in enumerate(rows)])
    facts |= {"computed_now": 3, "crashed": {}, "seconds": 1.0, "folder": str(folder)}
    runs.write(folder / runs.SUMMARY, json_text(facts))


def _calibration(file: Path) -> None:
    """What a detector may know of a Panda."""
    panda = ftqp.robots.load("panda")
    n = panda.nv
    Calibration(
        joints=panda.joints, drive="position", dt=1e-3, bandwidths=(5.0, 50.0), delay=0,
        room=np.ones((len(Residual), n)), sigma=1e-4, quantum=0.0, coulomb=np.zeros(n), viscous=np.zeros(n),
        hours=1.0, rate=0.1, alarms=0, rate_low=0.0, rate_high=3.0, extrapolated=False,
    ).save(file)  # fmt: skip
