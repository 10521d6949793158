"""Reading MJCF."""

import numpy as np
import pytest

from ftqp.core.errors import InputError, ModelError
from ftqp.model.robot import Robot

ARM = """<mujoco model="arm"><compiler angle="{angle}"/><worldbody>
<body name="one" pos="0 0 0.3"><inertial pos="0 0 0.1" mass="2" diaginertia="0.01 0.01 0.005"/>
<joint name="a" type="hinge" axis="{axis}" range="{turn}" armature="{armature}" actuatorfrcrange="-30 30"/>
<body name="two" pos="0 0 0.3"><inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.005"/>
<joint name="b" type="slide" axis="1 1 0" range="0.1 0.4"/><site name="tcp" pos="0.1 0 0"/></body></body>
</worldbody>{more}</mujoco>"""


def arm(
    *, angle: str = "degree", axis: str = "0 0 1", turn: str = "-90 90", armature: str = "0", more: str = ""
) -> str:
    return ARM.format(angle=angle, axis=axis, turn=turn, armature=armature, more=more)


def test_site_is_the_tip_and_limits_are_in_radians_and_metres() -> None:
    robot = Robot.from_mjcf(arm(), limits={"v_max": 1.0})
    assert robot.name == "arm"
    assert robot.tip == "tcp"
    assert robot.limits.q_min == pytest.approx([-np.pi / 2, 0.1])
    assert robot.limits.q_max == pytest.approx([np.pi / 2, 0.4])
    assert robot.limits.tau_max.tolist() == [30.0, np.inf]
    assert robot.pose([np.pi / 2, 0.0])[:3, 3] == pytest.approx([0.0, 0.1, 0.6])
    assert robot.has_inertia


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (arm(axis="0 0 0"), "joint 'a' has a zero axis"),
        (arm(axis="0 0"), "joint 'a' has axis '0 0', expected 3 finite numbers"),
        (arm(armature="much"), "joint 'a' has armature 'much', expected a finite number"),
        (arm(armature="-1"), r"joint 'a' has a rotor inertia \(armature\) of -1, expected >= 0"),
        (arm(turn="low high"), "joint 'a' has range 'low high', expected 2 finite numbers"),
        (arm(turn="90 -90"), "joint 'a' has crossed limits"),
        (
            arm(more='<equality><joint joint1="b" joint2="a" polycoef="0 1 0.5 0 0"/></equality>'),
            "joint 'b' mimics 'a', but along the curve '0 1 0.5 0 0'",
        ),
        (
            arm(more='<equality><joint joint1="b" polycoef="0.1 0 0 0 0"/></equality>'),
            "joint 'b' mimics 'a constant', but a constant moves no joint",
        ),
        (
            arm().replace('type="slide"', 'type="ball"').replace('axis="1 1 0" range="0.1 0.4"', ""),
            "'b' is of type",
        ),
    ],
)
def test_unsafe_files_are_refused(text: str, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        Robot.from_mjcf(text)


def test_a_joint_of_an_equality_follows_the_other_one() -> None:
    robot = Robot.from_mjcf(
        arm(more='<equality><joint joint1="b" joint2="a" polycoef="0.2 0.1"/></equality>')
    )
    assert robot.chain.lead.tolist()[1] == 0
    assert (robot.chain.ratio[1], robot.chain.offset[1]) == (0.1, 0.2)


def test_what_pinocchio_refuses_is_an_input_error() -> None:
    with pytest.raises(InputError, match=r"was refused by pinocchio: .*body"):
        Robot.from_mjcf("<mujoco/>")


def test_damping_and_frictionloss_are_read_with_the_defaults_of_their_class() -> None:
    text = arm().replace(
        "<worldbody>", '<default><joint damping="2" frictionloss="0.4"/></default><worldbody>'
    )
    robot = Robot.from_mjcf(text.replace('axis="1 1 0"', 'axis="1 1 0" damping="3"'), limits={"v_max": 1.0})
    assert robot.viscous.tolist() == [2.0, 3.0]
    assert robot.coulomb.tolist() == [0.4, 0.4]


@pytest.mark.parametrize("figure", ["much", "1 2 3", "inf"])
def test_damping_that_pinocchio_would_take_for_none_is_refused(figure: str) -> None:
    with pytest.raises(ModelError, match=f"joint 'a' has damping '{figure}', expected a finite number"):
        Robot.from_mjcf(arm(armature=f'0" damping="{figure}'))


def test_masses_that_stand_in_geoms_are_those_of_mujoco():
    mujoco = pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    text = """<mujoco><compiler angle="radian"/><worldbody><body name="a" pos="0 0 .2">
    <joint name="j1" axis="0 0 1" range="-2 2"/>
    <geom type="capsule" fromto="0 0 0 .1 0 .3" size=".03" mass="2"/>
    <body name="b" pos=".1 0 .3" euler=".3 0 0">
    <joint name="j2" axis="0 1 0" pos="0 .02 0" range="-2 2" armature=".1"/>
    <geom type="box" size=".05 .03 .1" density="800"/>
    <body name="fixed" pos="0 .1 .1" euler="0 .4 .2">
    <geom type="sphere" size=".04" mass=".7"/><site name="tool"/>
    </body></body></body></worldbody></mujoco>"""
    robot = Robot.from_mjcf(text, tip="tool", limits={"v_max": 1.0})
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for q in ([0.0, 0.0], [0.4, -0.9]):
        data.qpos[:] = q
        data.qvel[:] = [0.3, -0.5]
        mujoco.mj_forward(model, data)
        M = np.empty((2, 2))
        mujoco.mj_fullM(model, data, M)
        assert np.allclose(robot.mass_matrix(q), M, atol=1e-12)
        assert np.allclose(robot.bias(q, [0.3, -0.5]), data.qfrc_bias, atol=1e-12)
