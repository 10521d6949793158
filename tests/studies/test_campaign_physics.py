"""The campaign in physics, some episodes of it: resumed, not repeated, and told as a table."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')

SCRIPT = Path(__file__).parents[2] / "studies" / "campaign_physics.py"


def said(folder, name, episodes):
    """The tables of the report that the script writes."""
    files = ["--file", str(folder / name), "--out", str(folder)]
    subprocess.run(
        [sys.executable, str(SCRIPT), "--episodes", str(episodes), *files], capture_output=True, check=True
    )
    report = (folder / "campaign_physics-quick.md").read_text(encoding="utf-8")
    assert "mujoco " in report
    return report[report.index(f"{episodes} episodes") : report.index("## Versions")]


@pytest.mark.slow
def test_campaign_goes_on_where_it_was_and_breaks_no_law_that_never_may_be(tmp_path):
    first = said(tmp_path, "a.sqlite", 3)
    again = said(tmp_path, "a.sqlite", 6)
    whole = said(tmp_path, "b.sqlite", 6)
    assert first != again == whole
    header, _, counts = (line.split(" | ") for line in whole.splitlines()[2:5])
    for law in ("divergence", "torque", "false OK"):
        assert counts[header.index(law)] == "0"


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
