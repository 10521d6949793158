"""Reading URDF."""

from collections.abc import Callable

import pytest

from ftqp.core.errors import ModelError
from ftqp.model.audit import Severity
from ftqp.model.limits import RISE_TIME
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


def test_figures_of_the_file_arrive_to_the_last_bit(two_joints: Urdf) -> None:
    text = two_joints(origin="0.1 0.2 0.30000000000000004", mass="2.0000000000000004")
    robot = Robot.from_urdf(text)
    assert robot.chain.translation[0].tolist() == [0.1, 0.2, 0.30000000000000004]
    assert robot.chain.mass[0] == 2.0000000000000004


PLAIN = 'lower="-1" upper="2" velocity="1.5" effort="20"'
DRAKE = 'xmlns:drake="http://drake.mit.edu"'


def read(two_joints: Urdf, more: str, **given: object) -> Robot:
    text = two_joints(limit=f"{PLAIN} {more}").replace('name="two">', f'name="two" {DRAKE}>', 1)
    return Robot.from_urdf(text, **given)


@pytest.mark.parametrize(
    ("more", "least"),
    [
        ('acceleration="3"', 3.0),
        ('deceleration="2.5"', 2.5),
        ('acceleration="3" deceleration="3"', 3.0),
        ('acceleration="3" deceleration="2"', 2.0),
        ('acceleration="3" deceleration="5"', 3.0),
        ('acceleration="3" drake:acceleration="4"', 3.0),
        ('acceleration="5" drake:acceleration="4" deceleration="6"', 4.0),
        ('acceleration="inf" deceleration="6"', 6.0),
    ],
)
def test_smallest_of_what_bounds_the_acceleration_is_taken(two_joints: Urdf, more: str, least: float) -> None:
    robot = read(two_joints, more)
    assert robot.limits.a_max.tolist() == [least, 2.0 / RISE_TIME]  # joint b has none
    said = [f for f in robot.findings if f.sentence.startswith("joint 'a' has limits of")]
    values = {float(word.split("=")[1].strip('"')) for word in more.split()}
    assert len(said) == (len(values) > 1)
    assert all(f"the smallest, {least:g}, is taken" in f.sentence for f in said)


@pytest.mark.parametrize("key", ["acceleration", "deceleration", "drake:acceleration", "jerk"])
@pytest.mark.parametrize("value", ["0", "-1", "nan", "fast", "", "1_000", "٣"])
def test_limit_that_is_none_is_refused_with_its_joint_and_attribute(
    two_joints: Urdf, key: str, value: str
) -> None:
    message = rf"joint 'a' has the limit {key}='{value}', expected a number > 0"
    with pytest.raises(ModelError, match=message):
        read(two_joints, f'{key}="{value}"')


def test_guess_that_the_torques_cannot_keep_up_with_is_a_warning(two_joints: Urdf) -> None:
    """Joint b: M = 0.02 + 1 kg (0.1 m)^2 = 0.03 kg m2 and gravity up to 1 N m."""
    robot = read(two_joints, 'acceleration="3"', limits={"tau_max": [20.0, 1.1]})
    (guess,) = (f for f in robot.findings if f.about == "a_max")
    assert guess.severity is Severity.WARNING
    assert ", which b cannot keep up everywhere: b 10 (torque allows" in str(guess)
    figure = float(str(guess).partition("torque allows ")[2].partition(")")[0])
    assert (1.1 - 9.81 * 0.1) / 0.03 <= figure <= 1.1 / 0.03
    assert not any(f.about == "a_max" for f in robot.with_limits(a_max=2.0).findings)
