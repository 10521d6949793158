"""The script that recomputes Zhang et al. 2016."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "studies" / "zhang2016.py"


@pytest.mark.slow
def test_quick_run_meets_the_expected_sweep_and_compares_every_method(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--quick", "--json", "--out", str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    sys.path.insert(0, str(SCRIPT.parent))
    from zhang2016 import METHODS, SWEEP

    for row in result["sweep"]:
        assert row["coverage"] == pytest.approx(SWEEP[row["theta"]][0], abs=0.01), row
    assert result["safe_start"] == {"pairs": 2800, "coverage": 1.0}
    assert [row["method"] for row in result["compared"] if row["path"] == "planar3"] == list(METHODS)
    assert all(row["grid"] < 1.0 for row in result["readings"])
    text = (tmp_path / "zhang2016-quick.md").read_text(encoding="utf-8")
    assert "## Limitations" in text and "## Every reading" in text
    assert len(list(tmp_path.glob("zhang2016-quick-*.png"))) == 3
