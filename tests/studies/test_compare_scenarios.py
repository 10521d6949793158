"""Logs of two checkouts are compared number by number."""

import json
import subprocess
import sys
from pathlib import Path

import compare_scenarios
import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "studies" / "compare_scenarios.py"
LOG = {"t": np.arange(3.0), "q.j1": np.array([0.0, np.nan, 2e6]), "step_time": np.ones(3)}


def log(**changed):
    return {**LOG, **{name.replace("_j", ".j"): np.array(value) for name, value in changed.items()}}


@pytest.mark.parametrize(
    ("value", "apart"),
    [
        ([2e-12, np.nan, 2e6], 2e-12),
        ([0.0, np.nan, 2e6 + 4e-6], 2e-12),
        ([0.0, 0.0, 2e6], np.inf),
        ([0.0, np.nan, np.inf], np.inf),
        ([0.0, np.nan], np.inf),
    ],
)
def test_a_number_that_differs_is_found(value, apart) -> None:
    found = compare_scenarios.compared("some", LOG, log(q_j1=value))
    assert found["differing"] == ["q.j1"] and found["worst"] == "q.j1"
    assert found["difference"] == pytest.approx(apart, rel=1e-3)


def test_what_was_meant_to_differ_is_of_a_scenario_that_is_bundled() -> None:
    assert {name for name, _ in compare_scenarios.MEANT} <= compare_scenarios.scenarios_of(ROOT)


@pytest.mark.slow
@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="needs the repository's history")
def test_script_runs_both_checkouts() -> None:
    command = [sys.executable, str(SCRIPT), "--against", "HEAD", "--names", "puma-step-10", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    (one,) = json.loads(done.stdout)["scenarios"]
    # the other checkout has no built kernel: its plain Python rounds where built code fuses
    assert one["difference"] < 1e-12 and one["signals"] > 80 and one["rows"] == 51
