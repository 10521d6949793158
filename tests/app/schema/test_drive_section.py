"""What a scenario says of the planner's drive, and what it is told of a wrong one."""

from pathlib import Path
from typing import Any

import pytest

from ftqp.app.scenario.document import Document
from ftqp.app.scenario.setup import Setup, resolve, validated
from ftqp.core.errors import ScenarioError


def setup(planner: dict[str, Any]) -> Setup:
    """What a scenario with this table of the planner stands for."""
    content: dict[str, Any] = {
        "robot": {"name": "panda"},
        "planner": planner,
        "path": {"kind": "line", "displacement": [0.1, 0.0, 0.0], "duration": 1.0},
    }
    found = Document(name="test", origin="test", folder=Path.cwd(), content=content)
    return resolve(found, validated(found))


def test_drive_is_a_name_or_a_table() -> None:
    assert setup({}).planner.drive.kind == "position"
    assert setup({"drive": "torque"}).planner.drive.kind == "torque"
    drive = setup({"drive": {"kind": "velocity", "bandwidth": 90.0, "latency": 0.002}}).planner.drive
    assert (drive.kind, drive.bandwidth, drive.latency) == ("velocity", 90.0, 0.002)


def test_noise_is_what_the_planner_believes() -> None:
    assert setup({"noise": {"q": 1e-4, "tau": 0.2}}).planner.noise.q == 1e-4


@pytest.mark.parametrize(
    ("planner", "sentence"),
    [
        ({"drive": "force"}, "planner.drive.kind is 'force', expected one of position, velocity, torque"),
        ({"drive": 3}, "planner.drive is 3, expected position, velocity, torque or a table with a kind"),
        ({"drive": {"band": 3.0}}, "planner.drive.band is not a key"),
        ({"drive": {"bandwidth": 0.0}}, "planner.drive.bandwidth is 0.0, expected a number greater than 0"),
        ({"drive": {"latency": -1.0}}, "planner.drive.latency is -1.0, expected a number at least 0"),
        ({"drive": {"latency": 9.0}}, "planner: latency of the drive is 9 s"),
        ({"drive": {"stiffness": 10.0}}, "planner.drive: stiffness is for drive 'torque'"),
        ({"drive": {"kind": "torque", "lead": 0.01}}, "planner.drive: lead is for drive 'position'"),
        ({"noise": {"q": -1.0}}, "planner.noise.q is -1.0, expected a number at least 0"),
        ({"noise": {"v": 0.1}}, "planner.noise.v is not a key"),
    ],
)
def test_every_wrong_key_is_told_with_its_place(planner: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        setup(planner)
    assert sentence in str(caught.value)
