"""Torque limits at the actuators of an MJCF file, beside MuJoCo's own reading."""

import numpy as np
import pytest

from ftqp.core.errors import ModelError
from ftqp.model.robot import Robot

ARM = """<mujoco>{settings}<worldbody>
<body name="one"><inertial pos="0 0 0.1" mass="2" diaginertia="0.01 0.01 0.005"/>
<joint name="a" axis="0 0 1" range="-1 1" {more}/>
<body name="two" pos="0 0 0.3"><inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.005"/>
<joint name="b" axis="0 1 0" range="-1 1"/><site name="tcp" pos="0.1 0 0"/></body></body>
</worldbody><actuator>{actuators}</actuator></mujoco>"""
CLASSES = """<default><default class="big"><general biastype="affine" forcerange="-87 87"/>
<default class="small"><position forcerange="-12 12"/></default></default></default>"""


def limits_of(actuators, settings="", more=""):
    text = ARM.format(actuators=actuators, settings=settings, more=more)
    return Robot.from_mjcf(text, limits={"v_max": 1.0}).limits.tau_max.tolist()


@pytest.mark.parametrize(
    ("actuators", "settings", "expected"),
    [
        ('<motor joint="a" ctrlrange="-32 32"/><motor joint="b" ctrlrange="-13 13"/>', "", [32.0, 13.0]),
        ('<motor joint="a" ctrlrange="-1 1" gear="50"/>', "", [50.0, np.inf]),
        ('<motor joint="a" ctrlrange="-3 3"/><motor joint="a" ctrlrange="-4 4"/>', "", [7.0, np.inf]),
        ('<motor joint="a" ctrlrange="-3 3"/><motor joint="a"/>', "", [np.inf, np.inf]),
        ('<motor joint="a" ctrlrange="-3 3"/><motor joint="a" gear="0"/>', "", [3.0, np.inf]),
        ('<position joint="a" kp="100" ctrlrange="-1 1"/>', "", [np.inf, np.inf]),
        ('<general joint="a" gainprm="20" ctrlrange="-2 2" forcerange="-30 35"/>', "", [30.0, np.inf]),
        ('<general class="big" joint="a"/><general class="small" joint="b"/>', CLASSES, [87.0, 12.0]),
        ('<motor joint="a" ctrlrange="-3 3"/>', '<compiler autolimits="false"/>', [np.inf, np.inf]),
        (
            '<motor joint="a" ctrlrange="-3 3" ctrllimited="true"/>',
            '<compiler autolimits="false"/>',
            [3.0, np.inf],
        ),
        ('<motor joint="a" ctrlrange="-3 3" ctrllimited="false"/>', "", [np.inf, np.inf]),
    ],
)
def test_the_most_that_actuators_give(actuators, settings, expected):
    assert limits_of(actuators, settings) == expected


def test_the_smaller_one_counts_of_joint_and_actuator():
    assert limits_of('<motor joint="a" ctrlrange="-40 40"/>', more='actuatorfrcrange="-30 30"')[0] == 30.0


@pytest.mark.parametrize(
    ("actuator", "message"),
    [
        (
            '<motor joint="a" ctrlrange="much"/>',
            "actuator 'a' has ctrlrange 'much', expected two numbers",
        ),
        ('<motor name="m" joint="a" ctrlrange="3 -3"/>', "the actuator 'm' has ctrlrange '3 -3'"),
        ('<motor joint="a" ctrlrange="-3 3" gear="fast"/>', "the actuator 'a' has gear 'fast'"),
    ],
)
def test_a_range_that_is_none_is_refused(actuator, message):
    with pytest.raises(ModelError, match=message):
        limits_of(actuator)


def test_mujoco_reads_the_same():
    mujoco = pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    actuators = '<general class="big" joint="a"/><general class="small" joint="b" gear="2"/>'
    read = mujoco.MjModel.from_xml_string(ARM.format(actuators=actuators, settings=CLASSES, more=""))
    assert limits_of(actuators, CLASSES) == list(read.actuator_forcerange[:, 1] * read.actuator_gear[:, 0])
