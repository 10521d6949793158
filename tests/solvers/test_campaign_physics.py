"""The campaign in physics, some episodes of it: resumed, not repeated, and told as a table."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install "ftqp[sim]"')

SCRIPT = Path(__file__).parents[2] / "solvers" / "campaign_physics.py"


def said(file, episodes):
    """What the script prints."""
    choices = ["--episodes", str(episodes), "--out", str(file)]
    done = subprocess.run([sys.executable, str(SCRIPT), *choices], capture_output=True, text=True, check=True)
    return done.stdout


@pytest.mark.slow
def test_campaign_goes_on_where_it_was_and_breaks_no_law_that_never_may_be(tmp_path):
    first = said(tmp_path / "a.sqlite", 3)
    assert "3 episodes" in first
    again = said(tmp_path / "a.sqlite", 6)
    whole = said(tmp_path / "b.sqlite", 6)
    assert again.rpartition("\n\n")[0] == whole.rpartition("\n\n")[0]
    for law in ("divergence", "torque", "false OK"):
        assert f"| {law} | 0 | 0 | 0 |" in whole
