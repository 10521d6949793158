"""URDFs as they are found: each kind of flaw in every place where it may stand."""

from itertools import product

import numpy as np
import pytest

from ftqp.control.drive.joint_drive import Drive
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.target import Target
from ftqp.control.task.keep import TorqueLimits
from ftqp.core.errors import InputError, ModelError
from ftqp.model.audit import Severity
from ftqp.model.robot import Robot

MASS = (
    '<inertial><origin xyz="0 0 .1"/><mass value="1"/>'
    '<inertia ixx=".01" iyy=".01" izz=".005" ixy="0" ixz="0" iyz="0"/></inertial>'
)
LIMIT = 'lower="-2" upper="2" velocity="1" effort="50"'
KINDS = ("revolute", "prismatic")


def arm(
    limits=(LIMIT,) * 3,
    kinds=("revolute",) * 3,
    masses=True,
    inside=("", "", ""),
    step=(0.1, 0.2, 0.3),
    more="",
    root="",
    head="",
):
    """A URDF of three joints; whatever is wrong with it is said by keyword, one each."""
    body = MASS if masses else ""
    parts = [f'{head}<robot name="probe"{root}><link name="l0"/>']
    for i, (limit, kind, extra, z) in enumerate(zip(limits, kinds, inside, step, strict=True), 1):
        axis = "0 0 1" if i == 1 else "0 1 0"
        parts.append(
            f'<link name="l{i}">{body}</link><joint name="j{i}" type="{kind}"><parent link="l{i - 1}"/>'
            f'<child link="l{i}"/><origin xyz="0 0 {z}"/><axis xyz="{axis}"/><limit {limit}/>{extra}</joint>'
        )
    parts.append('<link name="tip"/><joint name="jt" type="fixed"><parent link="l3"/><child link="tip"/>')
    parts.append(f'<origin xyz="0 0 .2"/></joint>{more}</robot>')
    return "".join(parts)


def said(robot, word):
    return [finding for finding in robot.findings if word in finding.sentence]


def at(places, changed, other=LIMIT):
    return [changed if i in places else other for i in range(3)]


# --- torque limits that nobody wrote

SILENT = ('lower="-2" upper="2" velocity="1" effort="0"', 'lower="-2" upper="2" velocity="1"')
PLACES = ((0,), (1, 2), (0, 1, 2))


@pytest.mark.parametrize(("limit", "places", "kind"), [*product(SILENT, PLACES, KINDS)])
def test_a_torque_limit_of_0_is_unknown_where_there_are_no_masses(limit, places, kind):
    robot = Robot.from_urdf(arm(at(places, limit), (kind,) * 3, masses=False))
    (one,) = said(robot, "torque limit")
    named = "every joint" if len(places) == 3 else ", ".join(f"j{i + 1}" for i in places)
    assert one.severity is Severity.NOTE and named in one.sentence
    assert np.isinf(robot.limits.tau_max[list(places)]).all()
    planner = Planner(robot)
    planner.reset(robot.neutral)
    assert planner.step(robot.neutral, None, Target(pose=robot.pose(robot.neutral))).status.name == "OK"


@pytest.mark.parametrize("limit", SILENT)
def test_an_arm_with_masses_whose_file_has_no_torque_limits_loads_and_is_refused_where_torques_are_used(
    limit,
):
    robot = Robot.from_urdf(arm((limit,) * 3))
    (one,) = said(robot, "no torque limit is known")
    assert one.severity is Severity.WARNING and "limits={'tau_max'" in one.sentence
    Planner(robot)
    for more in ({"drive": "torque"}, {"drive": Drive(kind="torque")}, {"constraints": [TorqueLimits()]}):
        with pytest.raises(InputError, match="with_limits"):
            Planner(robot, **more)
    known = robot.with_limits(tau_max=60.0)
    assert not said(known, "no torque limit is known")
    Planner(known, drive="torque", constraints=[TorqueLimits()])
    assert not said(Robot.from_urdf(arm((limit,) * 3), limits={"tau_max": 60.0}), "no torque limit is known")


# --- ranges that nobody wrote


@pytest.mark.parametrize(("places", "kind", "masses"), [*product(PLACES, KINDS, (True, False))])
def test_a_missing_range_is_named_and_its_remedy_leads_to_an_arm_that_moves(places, kind, masses):
    text = arm(at(places, 'velocity="1" effort="50"'), (kind,) * 3, masses=masses)
    with pytest.raises(ModelError) as caught:
        Robot.from_urdf(text)
    named = [f"j{i + 1}" for i in places]
    for name in named:
        (sentence,) = [one for one in caught.value.findings if f"'{name}'" in one]
        assert "missing" in sentence and "cannot move" not in sentence
        assert f"limits={{'q_min': {{'{name}': ...}}, 'q_max': {{'{name}': ...}}}}" in sentence
    given = {"q_min": dict.fromkeys(named, -1.0), "q_max": dict.fromkeys(named, 1.5)}
    robot = Robot.from_urdf(text, limits=given)
    assert (robot.limits.q_max[list(places)] == 1.5).all()


@pytest.mark.parametrize(
    ("limit", "low", "high", "side"),
    [
        ('lower="-1.5" velocity="1" effort="5"', -1.5, 0.0, "upper"),
        ('upper="1.5" velocity="1" effort="5"', 0.0, 1.5, "lower"),
    ],
)
def test_a_side_that_is_missing_is_0_as_in_ros_and_a_warning_says_so(limit, low, high, side):
    robot = Robot.from_urdf(arm(at((1,), limit)))
    (one,) = said(robot, f"no {side} limit")
    assert one.severity is Severity.WARNING and "'q_min'" in one.sentence and "'q_max'" in one.sentence
    assert (robot.limits.q_min[1], robot.limits.q_max[1]) == (low, high)


# --- what ROS' own reader takes

WILD = {
    "prefix of an element": arm(more='<gazebo><sensor:camera name="c"><x>1</x></sensor:camera></gazebo>'),
    "prefix of an attribute": arm(more='<gazebo a:b="1" c="2"/>'),
    "prefix in a joint": arm(inside=("", "<gz:x/>", "")),
    "prefix of one and the other": arm(more='<a:b xmlns:a="urn:a"/><a:b/>'),
    "default namespace": arm(root=' xmlns="http://www.ros.org"'),
    "dashes in a comment": arm(more="<!-- a -- b --- c ---->"),
    "comment of dashes": arm(more="<!------------------>"),
    "dashes before the root": arm(head="<!-- ==== -- made by -- -->\n"),
    "comment before the declaration": arm(head='<!-- a -- b --><?xml version="1.0" encoding="utf-8"?>\n'),
    "tags in a comment": arm(more="<!-- <joint name='j1' -- <a:b> & -->"),
    "comment in a text": arm(more="<gazebo><![CDATA[<!-- not -- one]]></gazebo>"),
}


@pytest.mark.parametrize("text", list(WILD.values()), ids=list(WILD))
def test_what_ros_and_pinocchio_read_is_read_and_changes_nothing(text):
    robot, plain = Robot.from_urdf(text), Robot.from_urdf(arm())
    assert robot.joints == plain.joints
    q = [0.3, -0.4, 0.5]
    np.testing.assert_array_equal(robot.pose(q), plain.pose(q))
    np.testing.assert_array_equal(robot.mass_matrix(q), plain.mass_matrix(q))


@pytest.mark.parametrize(
    ("more", "line"), [("<!-- a\n -- b\n -->\n<broken>", 5), ("<a:b>\n</a:c>", 3), ("<!-- open", 2)]
)
def test_what_is_broken_is_refused_with_its_line(more, line):
    with pytest.raises(InputError, match=f"not well-formed XML: .*line {line}"):
        Robot.from_urdf(arm(more="\n" + more))


# --- figures that are doubtful

SOFT = "<safety_controller k_velocity='10' {}/>"


@pytest.mark.parametrize(
    ("written", "remedy"),
    [
        ('soft_lower_limit="-1.5" soft_upper_limit="1.5"', "{'q_min': {'j2': -1.5}, 'q_max': {'j2': 1.5}}"),
        ('soft_lower_limit="-1.5"', "{'q_min': {'j2': -1.5}}"),
        ('soft_upper_limit="1.5"', "{'q_max': {'j2': 1.5}}"),
        ('soft_lower_limit="-3" soft_upper_limit="1.5"', "{'q_max': {'j2': 1.5}}"),
    ],
)
@pytest.mark.parametrize("kind", KINDS)
def test_soft_limits_within_the_range_are_a_warning_whose_remedy_keeps_them(written, remedy, kind):
    text = arm(kinds=(kind,) * 3, inside=("", SOFT.format(written), ""))
    (one,) = said(Robot.from_urdf(text), "soft limits")
    assert one.severity is Severity.WARNING and f"limits={remedy}" in one.sentence
    assert not said(Robot.from_urdf(text, limits=eval(remedy)), "soft limits")


@pytest.mark.parametrize(
    ("limit", "kind", "word"),
    [
        ('lower="-170" upper="170" velocity="1" effort="50"', "revolute", "degrees"),
        ('lower="0" upper="30" velocity="1" effort="50"', "revolute", "degrees"),
        ('lower="-2" upper="2" velocity="180" effort="50"', "revolute", "degrees a second"),
        ('lower="0" upper="850" velocity="1" effort="50"', "prismatic", "millimetres"),
        ('lower="0" upper="0.8" velocity="250" effort="50"', "prismatic", "millimetres a second"),
    ],
)
@pytest.mark.parametrize("places", PLACES)
def test_figures_that_look_like_another_unit_are_one_warning(limit, kind, word, places):
    robot = Robot.from_urdf(arm(at(places, limit), [kind if i in places else "revolute" for i in range(3)]))
    (one,) = said(robot, f"looks like {word}")
    assert one.severity is Severity.WARNING and all(f"j{i + 1} " in one.sentence for i in places)


@pytest.mark.parametrize("masses", [True, False])
def test_links_of_200_m_look_like_millimetres(masses):
    robot = Robot.from_urdf(arm(step=(100.0, 200.0, 300.0), masses=masses))
    (one,) = said(robot, "millimetres")
    assert one.severity is Severity.WARNING and "300 m" in one.sentence
    assert not said(Robot.from_urdf(arm()), "millimetres")


def test_a_tip_that_is_still_to_be_chosen_is_a_question():
    two = arm(
        more='<link name="camera"/><joint name="c" type="fixed"><parent link="l3"/>'
        '<child link="camera"/></joint>'
    )
    with pytest.raises(
        ModelError, match=r"^probe needs a tip\n  - probe has 2 possible tips; .*tip="
    ) as caught:
        Robot.from_urdf(two)
    assert "unsafe" not in str(caught.value) and len(caught.value.findings) == 1
    assert Robot.from_urdf(two, tip="camera").tip == "camera"
