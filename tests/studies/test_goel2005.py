"""The script that recomputes Goel et al. 2005."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "studies" / "goel2005.py"


@pytest.mark.slow
def test_quick_run_meets_the_expected_ends_and_draws_every_picture(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--quick", "--json", "--out", str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    for row in result["ends"]:
        assert row["expected"].startswith(row["kind"]), row
    assert result["map"]["points"] == 2032 and result["brute_force"]["runs"] > 10_000
    assert len(list(tmp_path.glob("goel2005-quick-*.png"))) == 8
    text = (tmp_path / "goel2005-quick.md").read_text(encoding="utf-8")
    assert "## Limitations" in text and "## Versions" in text
