"""What a scenario says of the planner's drive, and what it is told of a wrong one."""

from typing import Any

import pytest
from tests.app.conftest import setup_of

from ftqp.core.errors import ScenarioError


def test_drive_is_a_name_or_a_table() -> None:
    assert setup_of(planner={}).planner.drive.kind == "position"
    assert setup_of(planner={"drive": "torque"}).planner.drive.kind == "torque"
    drive = setup_of(
        planner={"drive": {"kind": "velocity", "bandwidth": 90.0, "latency": 0.002}}
    ).planner.drive
    assert (drive.kind, drive.bandwidth, drive.latency) == ("velocity", 90.0, 0.002)


def test_noise_is_what_the_planner_believes() -> None:
    assert setup_of(planner={"noise": {"q": 1e-4, "tau": 0.2}}).planner.noise.q == 1e-4


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
        setup_of(planner=planner)
    assert sentence in str(caught.value)
