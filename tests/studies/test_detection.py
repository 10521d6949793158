"""The study of detection: its arms in physics, what it counts, and its report."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')

from alarms import detection_cases as drawn
from alarms import detection_figures, detection_scores
from alarms.detection_world import Configuration, world

SCRIPT = Path(__file__).parents[2] / "studies" / "detection.py"
SERVO = Configuration("panda", "position 15 Hz", "real")


class Threshold:
    """A detector of one threshold: a joint 4 mrad off its reference is locked; it is all that it says."""

    def __init__(self, late: int, size: float = 4e-3) -> None:
        self._late, self._size = late, size
        self.reset()

    def reset(self) -> None:
        """Begin anew."""
        self._ring: list[Any] = []

    def keep(self) -> Any:
        """All that it remembers."""
        return list(self._ring)

    def restore(self, kept: Any) -> None:
        """Remember what was kept."""
        self._ring = list(kept)

    def look(self, log: Any, first: int, end: int) -> Any:
        """Rows up to the first finding."""
        trace = []
        for k in range(first, end):
            known = len(self._ring) > self._late
            off = np.abs(log.q[k] - self._ring[-1 - self._late]) / self._size if known else np.zeros(log.nv)
            self._ring.append(log.q_ref[k])
            off = np.nan_to_num(off)
            trace.append(off.max())
            if off.max() > 1.0:
                return k + 1, np.array(trace), [(int(np.argmax(off)), ["locked"], None)]
        return end, np.array(trace), []


@pytest.fixture(scope="module")
def motion() -> drawn.Motion:
    return drawn.motion(SERVO, [5, 1], drawn.KINDS, 1)


def test_arm_that_goes_on_from_a_kept_instant_without_a_fault_moves_as_if_nothing_had_been() -> None:
    there, generator = world(SERVO), np.random.default_rng(5)
    kept: dict[int, Any] = {700: None}
    trunk, led = drawn.healthy(there, generator, kept)
    there.restore(kept[700])
    again = drawn.branch(there, trunk, led, 700, 1000, None, 0)
    np.testing.assert_array_equal(again.seen, trunk.seen[700:1000])
    np.testing.assert_array_equal(again.truth, trunk.truth[700:1000])


def test_detector_of_one_threshold_finds_locks_and_nothing_else(motion: drawn.Motion) -> None:
    rows = detection_scores.judged(Threshold(SERVO.latency, 8e-3), motion, "encoders", SERVO)
    assert [row["kind"] for row in rows] == [case.kind for case in motion.cases]
    for row in rows:
        assert not row["early"]
        assert detection_figures.is_right(row) == (
            row["kind"].startswith("locked") and row["of"] == row["joint"]
        )
    assert any(detection_figures.is_right(row) for row in rows)


def test_intervals_are_those_of_clopper_and_pearson() -> None:
    assert detection_figures.interval(1000, 1000)[0] == pytest.approx(0.025 ** (1 / 1000), abs=1e-9)
    assert detection_figures.interval(0, 0) == (0.0, 1.0)
    assert detection_figures.rate_bound(0, 30.0) == pytest.approx(0.1, abs=2e-4)  # -ln(0.05)/30 h


def test_tables_of_the_docs_are_those_of_the_report() -> None:
    text, report = (
        (SCRIPT.parents[1] / name).read_text(encoding="utf-8")
        for name in ("docs/evidence/detection.md", "studies/results/detection.md")
    )
    copied = text.partition("<!-- begin detection -->")[2].partition("<!-- end detection -->")[0]
    rows = [line for line in copied.splitlines() if line.startswith("|")]
    assert len(rows) > 10 and set(rows) <= set(report.splitlines())


@pytest.mark.slow
def test_quick_study_scores_the_detector_and_goes_on_where_it_was(tmp_path: Path) -> None:
    choices = ["--robots", "panda", "--drives", "torque", "--settings", "nominal", "--json"]
    choices += ["--calibration", "0.02", "--file", str(tmp_path / "kept.sqlite"), "--out", str(tmp_path)]
    command = [sys.executable, str(SCRIPT), *choices]
    found, whole = [], ["--cases", "8", "--hours", "0.01"]
    for more in (["--cases", "2", "--hours", "0"], whole, whole):
        done = subprocess.run([*command, *more], capture_output=True, text=True, check=False, timeout=900)
        assert done.returncode == 0, done.stderr
        found.append(json.loads(done.stdout)["rows"])
    assert found[1] == found[2] and found[0][0]["cells"]["dropped"]["cases"] == 2
    cells = found[1][0]["cells"]
    assert cells["dropped"]["soon"] == cells["dropped"]["cases"] == 8
    assert "# Detection of failures" in (tmp_path / "detection.md").read_text(encoding="utf-8")
