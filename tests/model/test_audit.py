"""Every finding of the audit, through the loader a user would use."""

from collections.abc import Callable

import pinocchio as pin
import pytest

from ftqp.core.errors import ModelError
from ftqp.model import catalog
from ftqp.model.robot import Robot

Urdf = Callable[..., str]

UNSAFE = [
    ({"limit": 'lower="2" upper="1" velocity="1" effort="1"'}, "'a' has crossed limits 2 > 1"),
    (
        {"limit": 'lower="1" upper="1" velocity="1" effort="1"'},
        r"'a' cannot move: both limits are 1; hold it with",
    ),
    ({"limit": ""}, "'a' has a position limit that is missing or not a number"),
    ({"limit": ""}, "'a' has a velocity limit that is missing or not a number"),
    ({"limit": 'lower="-1" upper="1" effort="1"'}, "'a' has a velocity limit that is missing"),
    ({"limit": 'lower="-1" upper="1" velocity="1"'}, "'a' has a torque limit that is missing"),
    (
        {"limit": 'lower="nan" upper="1" velocity="1" effort="1"'},
        "'a' has a position limit that is missing or not",
    ),
    (
        {"limit": 'lower="-1" upper="1" velocity="fast" effort="1"'},
        "'a' has a velocity limit that is missing or not",
    ),
    (
        {"limit": 'lower="-1" upper="1" velocity="0" effort="1"'},
        r"'a' has a zero velocity limit.*limits=\{'v_max': \{'a'",
    ),
    (
        {"limit": 'lower="-1" upper="1" velocity="1" effort="0"'},
        r"'a' has a zero torque limit.*limits=\{'tau_max': \{'a'",
    ),
    (
        {"limit": 'lower="-1" upper="1" velocity="-2" effort="1"'},
        "'a' has a velocity limit of -2, expected > 0",
    ),
    ({"axis": "0 0 0"}, "'a' has a zero axis"),
    ({"axis": "0 0"}, "'a' has an axis that is not three finite numbers"),
    (
        {"joint": '<mimic joint="c"/>'},
        r"'a' mimics 'c', but that is no joint that moves; or hold it with locked=\['a'\]",
    ),
    ({"ixx": "-0.01"}, "body behind joint 'a' has a negative principal moment of inertia"),
]


@pytest.mark.parametrize(("figures", "message"), UNSAFE)
def test_unsafe_figure_is_refused(two_joints: Urdf, figures: dict[str, str], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        Robot.from_urdf(two_joints(**figures), "two")


def test_a_misspelt_tip_is_all_that_is_said(two_joints: Urdf) -> None:
    with pytest.raises(
        ModelError, match=r"^two has no such tip\n  - 'twoo' is not a frame of .*'two'.*$"
    ) as caught:
        Robot.from_urdf(two_joints(), "twoo")
    assert len(caught.value.findings) == 1 and "note" not in str(caught.value)


def test_all_findings_come_at_once(two_joints: Urdf) -> None:
    text = two_joints(
        axis="0 0 0",
        limit='lower="2" upper="1" velocity="0" effort="nan"',
        mass="-1",
        joint='<mimic joint="c"/>',
    )
    with pytest.raises(ModelError) as caught:
        Robot.from_urdf(text, "twoo")
    everything = "\n".join(caught.value.findings)
    parts = (
        "not a frame",
        "zero axis",
        "crossed",
        "zero velocity",
        "torque limit that",
        "mass of -1",
        "mimics",
    )
    for part in parts:
        assert part in everything


def test_body_without_mass_is_a_warning_and_the_last_one_makes_the_inertia_singular(two_joints: Urdf) -> None:
    light = Robot.from_urdf(
        two_joints(mass="0", ixx="0").replace('iyy="0.02"', 'iyy="0"', 1).replace("0.015", "0", 1)
    )
    assert any("behind joint 'a' has no mass" in f.sentence for f in light.findings)
    model = catalog.load("planar6").model.copy()
    model.inertias[6] = pin.Inertia.Zero()
    with pytest.raises(ModelError, match="joint-space inertia that is not positive definite"):
        Robot.from_pinocchio(model)
    assert not Robot.from_pinocchio(model, kinematics_only=True).has_inertia


def test_joint_that_follows_a_moving_one_but_is_held_is_a_warning(two_joints: Urdf) -> None:
    more = """<link name="three"/><joint name="c" type="revolute"><parent link="one"/><child link="three"/>
    <axis xyz="0 0 1"/><mimic joint="a"/></joint>"""
    robot = Robot.from_urdf(two_joints(more=more), "two")
    assert any("'c' mimics 'a' but is held still" in f.sentence for f in robot.findings)
    asked = Robot.from_urdf(two_joints(more=more), "two", ["c"])
    assert not any("mimics" in f.sentence for f in asked.findings)
