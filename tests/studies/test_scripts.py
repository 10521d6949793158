"""The scripts of studies run from end to end, and what they find is what they promise."""

import json
import subprocess
import sys
from pathlib import Path

import compare_scenarios
import numpy as np
import pytest
from study_coverage import Subject, verdicts
from tests.scripts import ran, told

INCH = 0.0254


def test_goel2005_meets_the_expected_ends_and_draws_every_picture(tmp_path: Path) -> None:
    told("studies/goel2005.py", "--quick", "--out", tmp_path)
    result = json.loads((tmp_path / "goel2005-quick.json").read_text(encoding="utf-8"))
    for row in result["ends"]:
        assert row["expected"].startswith(row["kind"]), row
    assert result["map"]["points"] == 2032 and result["brute_force"]["runs"] > 10_000
    drawn = {file.stem.removeprefix("goel2005-quick-") for file in tmp_path.glob("goel2005-quick-*.png")}
    figures = {"figure-5", "figure-6", "cycle", "basins", "two-links", "map-R"}
    assert drawn == figures | {f"rests-j{joint}" for joint in (1, 2, 3)}


def test_figures_of_papers_are_made_again_by_a_command_each(tmp_path: Path) -> None:
    """Values that tests/papers computes in its own way, and the pictures."""
    expected = {
        "jin2017": ("3.69e-06 m", "3.48e-06 m", "stop at 16.83 s", "at most 0"),
        "holt1994": ("12.0 cm", "1.6 cm", "0.1 cm"),
        "bedrossian1993": ("move by 0 rad", "5.02 deg/s", "50 deg/s at 2.21 s", "92.4 % of the way"),
    }
    for name, values in expected.items():
        rows = json.loads(told(f"studies/{name}.py", "--quick", "--json"))["rows"]
        assert all(value in row["ours"] for value, row in zip(values, rows, strict=False)), rows
    assert ran("studies/holt1994.py", "--quick", "--out", tmp_path).returncode == 0
    assert len(list(tmp_path.glob("holt1994-quick-*.png"))) == 2


def test_zhang2016_meets_the_expected_sweep_and_compares_every_method(tmp_path: Path) -> None:
    from zhang2016 import METHODS, SWEEP

    told("studies/zhang2016.py", "--quick", "--out", tmp_path)
    result = json.loads((tmp_path / "zhang2016-quick.json").read_text(encoding="utf-8"))
    for row in result["sweep"]:
        assert row["coverage"] == pytest.approx(SWEEP[row["theta"]][0], abs=0.01), row
    assert result["safe_start"] == {"pairs": 2800, "coverage": 1.0}
    assert [row["method"] for row in result["compared"] if row["path"] == "planar3"] == list(METHODS)
    assert len(list(tmp_path.glob("zhang2016-quick-*.png"))) == 3


def test_locked_joints_do_not_keep_the_arm_from_its_line() -> None:
    tables = json.loads(told("studies/lock_sets.py", "--quick", "--setting", "default", "--json"))["tables"]
    assert [table["start"] for table in tables] == ["N", "R"]
    for table in tables:
        # Calm gives up two sets more than an arm without it, which swings at its limits to find a way on:
        # j2 and j11 from both starts, j3, j5 and j11 from R (docs/theory/path-progress.md, "Stalls").
        assert table["complete"] >= 30 and table["sets"] == 34
        assert table["complete"] + table["blocked"] == table["sets"]
        assert table["worst_off_path"] < 0.15 * INCH
        assert table["fastest"] <= 1.0 + 1e-9


def test_a_short_day_is_told_part_by_part(tmp_path: Path) -> None:
    given = ("--hours", 0.01, "--cases", "spinning", "circle", "--jobs", 2, "--out", tmp_path, "--json")
    spinning, circle = json.loads(told("studies/long_run.py", *given))["cases"]
    for case, laps in ((spinning, 48 * 40.0), (circle, 48 * 20.0)):
        assert case["summary"]["completed"] and case["simulated"] == laps
        assert max(part["time_error"] for part in case["parts"]) < 1e-12
        assert all(part["statuses"].keys() == {"OK"} for part in case["parts"])
    assert spinning["parts"][-1]["turns"] >= 46
    assert sum(part["rows"] for part in spinning["parts"]) == spinning["summary"]["steps"]


def test_a_falling_elbow_is_caught_within_speed_and_torque(tmp_path: Path) -> None:
    choices = ("--quick", "--robots", "panda", "--joints", 4, "--json", "--out", tmp_path)
    rows = json.loads(told("studies/study_free_swinging.py", *choices))["rows"]
    assert len(rows) == 2
    for row in rows:
        assert row["overspeed"] <= 1.02 and row["torque"] <= 1.0 + 1e-6


def test_a_commit_that_does_not_exist_is_refused_in_a_sentence() -> None:
    done = ran("studies/compare_scenarios.py", "--against", "no-such-commit")
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert "'no-such-commit' is no commit of this" in done.stderr


def test_a_lock_that_is_survived_and_one_that_is_not_end_as_predicted():
    subject = Subject("planar3-line", "as it is", "kinematic", Path())
    for joint, sample, survives in ((2, 100, True), (0, 100, False)):
        row = subject.case(joint, sample)
        assert verdicts(row) == (survives, survives, False)
        assert row["at"] == pytest.approx(2.5)


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


@pytest.mark.slow
@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="needs the repository's history")
def test_script_runs_both_checkouts() -> None:
    command = [sys.executable, str(SCRIPT), "--against", "HEAD", "--names", "puma-step-10", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    (one,) = json.loads(done.stdout)["scenarios"]
    # the other checkout has no built kernel: its plain Python rounds where built code fuses
    assert one["difference"] < 1e-12 and one["signals"] > 80 and one["rows"] == 51
