"""Robot files in which numbers, words and elements are exchanged: a robot, or one clear refusal."""

import re
import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import ftqp

URDF = """<robot name="arm"><link name="base"/>
<link name="upper"><inertial><origin xyz="0.1 0 0" rpy="0 0 0"/><mass value="1.5"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<link name="fore"><inertial><mass value="1"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<link name="tool"/>
<joint name="first" type="revolute"><parent link="base"/><child link="upper"/>
<origin xyz="0 0 0.1" rpy="0 0 0.2"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" velocity="1.5" effort="10"/><dynamics damping="0.1" friction="0.2"/></joint>
<joint name="second" type="continuous"><parent link="upper"/><child link="fore"/><origin xyz="0.5 0 0"/>
<axis xyz="0 0 1"/><limit velocity="1" effort="10"/></joint>
<joint name="third" type="fixed"><parent link="fore"/><child link="tool"/><origin xyz="0.5 0 0"/></joint>
</robot>"""
MJCF = """<mujoco model="arm"><compiler angle="radian"/>
<default><joint armature="0.1" damping="0.5"/></default>
<worldbody><body name="upper" pos="0 0 0.1" quat="1 0 0 0">
<joint name="first" type="hinge" axis="0 0 1" range="-2 2" frictionloss="0.1"/>
<inertial pos="0.1 0 0" mass="1.5" diaginertia="0.1 0.1 0.1"/>
<body name="fore" pos="0.5 0 0"><joint name="second" type="hinge" axis="0 0 1" range="-1 1"/>
<geom type="capsule" size="0.03" fromto="0 0 0 0.4 0 0" density="1000"/>
<body name="tool" pos="0.5 0 0" euler="0 0 0.1"><inertial pos="0 0 0" mass="0.5" diaginertia="0.1 0.1 0.1"/>
<site name="tip" pos="0.1 0 0"/></body></body></body></worldbody>
<actuator><motor joint="first" ctrlrange="-10 10"/><motor joint="second" ctrlrange="-10 10"/></actuator>
</mujoco>"""
NUMBERS = (
    "nan", "inf", "-inf", "1e308", "-1e308", "1e999", "5e-324", "1_000", "\uff11", "", "abc", "0", "-1",
    "1e-9", "0x10", "1,5", "2147483648", "1e16", "1e200",
)  # fmt: skip
WORDS = (
    "",
    "base",
    "../../etc/passwd",
    "\u202e",
    "x" * 300,
    "upper",
    "first",
    "floating",
    "planar",
    "ball",
    "0",
)
PLACE = re.compile(r'"([^"]*)"')


@st.composite
def changed(draw, text):
    """The text with one to three of its values exchanged, or elements left out or repeated."""
    for _ in range(draw(st.integers(1, 3))):
        if draw(st.integers(0, 9)) < 8:
            found = draw(st.sampled_from(list(PLACE.finditer(text))))
            parts = found[1].split()
            if parts and re.fullmatch(r"[-+0-9.eE]+", parts[0]):
                parts[draw(st.integers(0, len(parts) - 1))] = draw(st.sampled_from(NUMBERS))
            else:
                parts = [draw(st.sampled_from(WORDS))]
            text = f"{text[: found.start(1)]}{' '.join(parts)}{text[found.end(1) :]}"
        elif elements := list(re.finditer(r"<\w+[^<>]*/>", text)):
            found = draw(st.sampled_from(elements))
            text = text[: found.start()] + draw(st.sampled_from(["", 2 * found[0]])) + text[found.end() :]
    return text


def robot_or_refusal(make):
    """A robot that can be planned for, or an error of ftqp in one line a finding; no warning of numpy."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        try:
            robot = make()
        except ftqp.FtqpError as error:
            assert str(error).strip() and len(str(error)) < 5000
            return None
    assert np.isfinite(robot.pose(robot.neutral)).all()
    if robot.has_inertia:
        assert np.isfinite(robot.mass_matrix(robot.neutral)).all()
    return robot


FEW = settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


@FEW
@given(changed(URDF))
def test_changed_urdf_is_a_robot_or_refused(text):
    robot_or_refusal(lambda: ftqp.Robot.from_urdf(text, tip="tool"))


@FEW
@given(changed(MJCF))
def test_changed_mjcf_is_a_robot_or_refused(text):
    pytest.importorskip("mujoco")
    robot_or_refusal(lambda: ftqp.Robot.from_mjcf(text, limits={"v_max": 2.0}))


@pytest.mark.slow
@settings(FEW, max_examples=2000)
@given(changed(URDF), changed(MJCF))
def test_many_changed_models_are_robots_or_refused(urdf, mjcf):
    robot_or_refusal(lambda: ftqp.Robot.from_urdf(urdf, tip="tool"))
    robot_or_refusal(lambda: ftqp.Robot.from_mjcf(mjcf, limits={"v_max": 2.0}))
