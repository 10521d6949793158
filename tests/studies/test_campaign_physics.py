"""The campaign in physics, some episodes of it."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')

SCRIPT = Path(__file__).parents[2] / "studies" / "campaign_physics.py"


@pytest.mark.slow
def test_episodes_break_no_law_that_never_may_be(tmp_path):
    command = [sys.executable, str(SCRIPT), "--episodes", "6", "--json", "--out", str(tmp_path)]
    rows = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)["rows"]
    assert [seed for seed, *_ in rows] == list(range(6))
    for law in ("divergence", "torque", "false OK"):
        assert not any(outcome[law] for *_, outcome in rows)


@pytest.fixture(scope="module")
def campaign():
    """The script as a module."""
    spec = importlib.util.spec_from_file_location("campaign_physics", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]
