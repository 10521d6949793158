"""Files of each kind in which words, numbers and lines are exchanged: used, or refused in a sentence.

A longer search: ``pytest tests/robustness/test_changed_files.py -m slow``; robots: ``test_fuzzed_models.py``.
"""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from ftqp.app.campaign.episode_study import load_campaign
from ftqp.app.commands.mapping import load_study
from ftqp.app.scenario.setup import load
from ftqp.core.errors import FtqpError
from ftqp.faults.detection.calibration import Calibration
from ftqp.qp import QP, solve
from ftqp.sim.number_files import recorded_motion, waypoint_table

SCENARIO = load("planar3-line").toml
CAMPAIGN = """
[campaign]
episodes = 3
[scenario]
robot = { name = "planar" }
path = { kind = "circle", radius = 0.05, duration = 0.4 }
[vary]
"path.radius" = { uniform = [0.01, 0.1] }
"planner.level" = { one_of = ["velocity", "acceleration"], weights = [1, 2] }
"start.q" = { start = 0.1 }
"""
STUDY = """
[robot]
name = "planar"
[map]
goal = [1.0, 0.5]
grid = 8
configurations = 4
steps = 5
"""
PROFILE = 'name = "daqp"\ntolerance = 1e-9\nmax_iterations = 500\n'
WAYPOINTS = "t,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0.01,0,0,0,0,0,1\n2,0.02,0.01,0,0,0,0,1\n"
MOTION = "t,track,x,y,z,rx,ry,rz\n0,0,0,0,0,0,0,0\n1,0.1,0,0,0,0,0,0.1\n2,0,0,0,0,0,0,0\n"
CALIBRATION = json.dumps(
    {
        "format": 1, "joints": ["a", "b"], "drive": "position", "dt": 1e-3, "bandwidths": [5.0, 50.0],
        "delay": 0, "room": [[1.0, 1.0]] * 9, "sigma": 1e-4, "quantum": 0.0, "coulomb": [0.0, 0.0],
        "viscous": [0.0, 0.0], "hours": 1.0, "rate": 0.1, "alarms": 0, "rate_low": 0.0, "rate_high": 3.0,
        "extrapolated": False,
    },
    indent=1,
)  # fmt: skip
SMALL = QP(np.eye(2), np.array([-1.0, 2.0]), lb=np.zeros(2), ub=np.ones(2))


def run_four_ticks(file):
    setup = load(str(file))
    replace(setup, duration=4 * setup.planner.dt).simulation().run()


KINDS = {
    "scenario.toml": (SCENARIO, run_four_ticks),
    "campaign.toml": (CAMPAIGN, lambda file: [load_campaign(str(file)).setup(k) for k in range(2)]),
    "study.toml": (STUDY, lambda file: load_study(str(file))),
    "profile.toml": (PROFILE, lambda file: solve(SMALL, file)),
    "way.csv": (WAYPOINTS, waypoint_table),
    "motion.csv": (MOTION, lambda file: recorded_motion(file, ("track", "x", "y", "z", "rx", "ry", "rz"))),
    "calibration.json": (CALIBRATION, Calibration.load),
}
"""Of each kind of file a right one, and what a user does with it."""
TOKEN = re.compile(r"[-+\w.]+|[^\s\w]")
WORDS = (
    "nan", "inf", "-inf", "1e308", "-1e308", "1e999", "5e-324", "0", "-1", "1e-9", "2147483648", "9" * 400,
    "true", '"a"', '""', "[]", "{}", "[1.0]", "[[", "]", "=", ",", "\uff11", "1_000", "0x10", "\x1b[31m",
    "\0", "x" * 300, "2026-01-01", "planar", "velocity", "",
)  # fmt: skip


@st.composite
def changed(draw):
    """A kind of file, and its text with one to three words exchanged, or lines left out or repeated."""
    name = draw(st.sampled_from(sorted(KINDS)))
    lines = KINDS[name][0].splitlines()
    for _ in range(draw(st.integers(1, 3))):
        k = draw(st.integers(0, len(lines) - 1))
        tokens = list(TOKEN.finditer(lines[k]))
        if tokens and draw(st.integers(0, 9)) < 8:
            found = draw(st.sampled_from(tokens))
            lines[k] = lines[k][: found.start()] + draw(st.sampled_from(WORDS)) + lines[k][found.end() :]
        else:
            lines[k : k + 1] = draw(st.sampled_from([[""], [lines[k]] * 2]))
    return name, "\n".join(lines)


def use(drawn, folder: Path):
    """Use the file, or see it refused in words without control characters; it stays as it is."""
    name, text = drawn
    file = folder / name
    file.write_text(text, encoding="utf-8")
    try:
        KINDS[name][1](file)
    except FtqpError as error:
        said = str(error)
        assert 10 < len(said) < 5000 and said.replace("\n", "").isprintable(), said
    assert file.read_text(encoding="utf-8") == text


FEW = settings(
    max_examples=80, deadline=None, derandomize=True, phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)  # fmt: skip


@pytest.mark.parametrize("name", sorted(KINDS))
def test_right_file_is_used(name, tmp_path):
    (tmp_path / name).write_text(KINDS[name][0], encoding="utf-8")
    KINDS[name][1](tmp_path / name)


@FEW
@given(changed())
def test_changed_file_is_used_or_refused_in_a_sentence(tmp_path_factory, drawn):
    use(drawn, tmp_path_factory.getbasetemp())


@pytest.mark.slow
@settings(FEW, max_examples=5000, derandomize=False)
@given(changed())
def test_many_changed_files_are_used_or_refused_in_a_sentence(tmp_path_factory, drawn):
    use(drawn, tmp_path_factory.getbasetemp())
