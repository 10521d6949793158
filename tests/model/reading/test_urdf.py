"""Reading URDF."""

from collections.abc import Callable

import pytest

from ftqp.core.errors import ModelError
from ftqp.model.robot import Robot

Urdf = Callable[..., str]

BROKEN = [
    ('<link name="two"/>', "a link has the name 'two' again"),
    ("<link/>", "a link has no name"),
    ('<link name="loose"/>', r"there are 2 links without a parent \['base', 'loose'\], expected one base"),
    (
        '<joint name="c" type="fixed"><parent link="base"/><child link="nowhere"/></joint>',
        "joint 'c' has the child link 'nowhere', which does not exist",
    ),
    (
        '<joint name="c" type="fixed"><parent link="base"/><child link="two"/></joint>',
        "link 'two' is the child of both 'b' and 'c'; expected a tree",
    ),
    (
        '<link name="three"/><joint name="c" type="hinge"><parent link="base"/><child link="three"/></joint>',
        "joint 'c' has the type 'hinge', expected one of revolute",
    ),
]


@pytest.mark.parametrize(("more", "message"), BROKEN)
def test_links_that_are_not_a_tree_are_refused(two_joints: Urdf, more: str, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        Robot.from_urdf(two_joints(more=more), "two")


LOOP = """<robot name="loop"><link name="one"/><link name="two"/>
<joint name="a" type="fixed"><parent link="one"/><child link="two"/></joint>
<joint name="b" type="fixed"><parent link="two"/><child link="one"/></joint></robot>"""


@pytest.mark.parametrize(
    ("text", "message"), [(LOOP, "0 links without a parent"), ("<robot name='empty'/>", "there are no links")]
)
def test_loop_and_nothing_are_refused(text: str, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        Robot.from_urdf(text, "two")


def test_tip_may_be_a_link_or_a_joint(two_joints: Urdf) -> None:
    by_link, by_joint = Robot.from_urdf(two_joints(), "two"), Robot.from_urdf(two_joints(), "b")
    assert by_link.pose([0.1, 0.2]).tolist() == by_joint.pose([0.1, 0.2]).tolist()


def test_figures_of_the_file_arrive_to_the_last_bit(two_joints: Urdf) -> None:
    text = two_joints(origin="0.1 0.2 0.30000000000000004", mass="2.0000000000000004")
    robot = Robot.from_urdf(text)
    assert robot.chain.translation[0].tolist() == [0.1, 0.2, 0.30000000000000004]
    assert robot.chain.mass[0] == 2.0000000000000004


def test_unlimited_effort_of_a_continuous_joint_means_no_limit(two_joints: Urdf) -> None:
    robot = Robot.from_urdf(two_joints(kind="continuous", limit=""), limits={"v_max": 1.0})
    assert robot.limits.tau_max.tolist() == [float("inf"), 10.0]
