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


ONCE_BROKEN = {
    50186: "torque: told of a brake 50 ms late it went to eight times its speed limits",
    50161: "torque: a brake that slips while the arm is stopped threw the other joints about",
    50086: "velocity: an unknown load was LAGGING for ever",
    50127: "torque: dry friction made the tip's correction hunt over a target at rest",
    50153: "velocity: a joint without a motor threw the others about after a stop",
    50201: "position: the same, for ever",
    200058: "torque: a brake that slips, told of at once, let the others shake the arm",
    201071: "torque: the same, told of 50 ms late",
    200433: "torque: a brake that holds was taken for one that slips",
    50191: "position: a servo overshot the speed limit",
}


@pytest.mark.slow
@pytest.mark.parametrize("seed", ONCE_BROKEN)
def test_episode_that_once_broke_a_law_keeps_them_all(campaign, seed):
    outcome = campaign.judged(campaign.draw(seed))
    assert {law: outcome[law] for law in campaign.LAWS} == dict.fromkeys(campaign.LAWS, 0.0)
