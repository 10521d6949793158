"""Reading MJCF, beside MuJoCo itself."""

import sys
from importlib.util import find_spec
from pathlib import Path
from re import escape

import numpy as np
import pytest

from ftqp.core.errors import InputError, MissingPackage, ModelError
from ftqp.core.extras import remedy_for_extra
from ftqp.model.robot import Robot

mujoco = pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')

from tests.model.reading.mjcf_judge import differences  # noqa: E402  # it needs MuJoCo
from tests.model.reading.random_mjcf import TIP, random_mjcf  # noqa: E402

PACKAGES = ("mujoco", "gymnasium", "gymnasium_robotics", "dm_control", "robosuite", "metaworld")
"""Packages that bring MJCF files, read where they are installed."""
ARM = """<mujoco model="arm"><compiler angle="{angle}"/><worldbody>
<body name="one" pos="0 0 0.3"><inertial pos="0 0 0.1" mass="2" diaginertia="0.01 0.01 0.005"/>
<joint name="a" type="hinge" axis="{axis}" range="{turn}" armature="{armature}" actuatorfrcrange="-30 30"/>
<body name="two" pos="0 0 0.3"><inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.005"/>
<joint name="b" type="slide" axis="1 1 0" range="0.1 0.4"/><site name="tcp" pos="0.1 0 0"/></body></body>
{things}</worldbody>{more}</mujoco>"""


def arm(*, angle="degree", axis="0 0 1", turn="-90 90", armature="0", more="", things=""):
    return ARM.format(angle=angle, axis=axis, turn=turn, armature=armature, more=more, things=things)


def sentences(text, tip="tcp"):
    return " ".join(map(str, Robot.from_mjcf(text, tip=tip, limits={"v_max": 1.0}).findings))


def files_at_hand():
    folders = [
        Path(folder)
        for name in PACKAGES
        if (found := find_spec(name)) is not None
        for folder in found.submodule_search_locations or ()
    ]
    files = [file for folder in folders for file in sorted(folder.rglob("*.xml"))]
    return [file for file in files if "<mujoco" in file.read_text(encoding="utf-8", errors="replace")]


def ends_of(model):
    """The deepest named body behind the joints of each tree."""
    joints, parents, best = [0] * model.nbody, set(map(int, model.body_parentid[1:])), dict[int, int]()
    for b in range(1, model.nbody):
        first = model.body_jntadr[b]
        kinds = model.jnt_type[first : first + model.body_jntnum[b]]
        joints[b] = joints[model.body_parentid[b]] + int(np.sum(kinds >= 2))
        tree = int(model.body_rootid[b])
        if b not in parents and model.body(b).name and joints[b] > joints[best.get(tree, 0)]:
            best[tree] = b
    return [str(model.body(b).name) for b in best.values()]


@pytest.mark.long
@pytest.mark.parametrize(
    "seed", [*range(20), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(20, 60))]
)
def test_random_file_is_read_as_mujoco_reads_it(seed):
    text = random_mjcf(np.random.default_rng(seed))
    robot = Robot.from_mjcf(text, tip=TIP, limits={"v_max": 1.0})
    model = mujoco.MjModel.from_xml_string(text)
    assert differences(model, robot) == {}
    assert set(robot.joints) >= {
        model.joint(j).name for j in range(model.njnt) if model.joint(j).name[:1] == "j"
    }
    motors = {model.joint(int(model.actuator_trnid[a, 0])).name: a for a in range(model.nu)}
    assert robot.limits.tau_max.tolist() == [
        2.0 * abs(model.actuator_gear[motors[name], 0])
        if name in motors and robot.chain.lead[i] == i
        else np.inf
        for i, name in enumerate(robot.joints)
    ]


@pytest.mark.long
@pytest.mark.parametrize("file", files_at_hand(), ids=lambda file: file.name)
def test_file_at_hand_is_read_as_mujoco_reads_it(file):
    try:
        model = mujoco.MjModel.from_xml_path(str(file))
    except ValueError:
        with pytest.raises((InputError, ModelError)):
            Robot.from_mjcf(file)
        return
    for tip in ends_of(model):
        robot = Robot.from_mjcf(file, tip=tip, limits={"v_max": 1.0, "tau_max": 1e3})
        assert differences(model, robot) == {}, tip


def test_site_is_the_tip_and_limits_are_in_radians_and_metres():
    robot = Robot.from_mjcf(arm(), limits={"v_max": 1.0})
    assert robot.name == "arm"
    assert robot.tip == "tcp"
    assert robot.limits.q_min == pytest.approx([-np.pi / 2, 0.1])
    assert robot.limits.q_max == pytest.approx([np.pi / 2, 0.4])
    assert robot.limits.tau_max.tolist() == [30.0, np.inf]
    assert robot.pose([np.pi / 2, 0.0])[:3, 3] == pytest.approx([0.0, 0.1, 0.6])
    assert robot.has_inertia


def test_joints_of_which_no_speed_is_known_are_one_finding():
    (said,) = [one for one in map(str, Robot.from_mjcf(arm()).findings) if "velocity limit" in one]
    assert said == "no velocity limit is known of a, b; give limits={'v_max': ...}"
    assert "velocity limit" not in sentences(arm())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (arm(axis="0 0 0"), "axis too small in joint Element name 'a', id 0, line 3; correct it until"),
        (arm(armature="much"), "bad format in attribute 'armature' Element 'joint', line 3"),
        (arm(axis="nan 0 1"), "numbers among jnt_axis that are not finite"),
        (arm(armature="-1"), r"joint 'a' has a rotor inertia \(armature\) of -1, expected >= 0"),
        (arm(turn="90 -90"), "joint 'a' has crossed limits"),
        ("<mujoco/>", "robot has no joint that moves; expected an arm"),
        (arm(more="<extras/>"), "unrecognized element Element 'extras'"),
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
def test_unsafe_files_are_refused(text, message):
    with pytest.raises((InputError, ModelError), match=message):
        Robot.from_mjcf(text)


def test_a_ball_joint_that_is_locked_is_held():
    text = arm().replace('<site name="tcp"', '<joint name="c" type="ball" pos="0 .1 0"/><site name="tcp"')
    with pytest.raises(ModelError, match=r"joint 'c' is of type Spherical; .* hold it with locked="):
        Robot.from_mjcf(text, tip="tcp")
    robot = Robot.from_mjcf(text, tip="tcp", locked=["c"], limits={"v_max": 1.0})
    assert differences(mujoco.MjModel.from_xml_string(text), robot) == {}


def test_without_mujoco_the_extra_is_named(monkeypatch):
    for name in list(sys.modules):
        if name.startswith("ftqp.model.reading.") and ("mjcf" in name or "mujoco" in name):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    needs = "MuJoCo, which reads MJCF and simulates arms, needs the package 'mujoco', which is not installed"
    with pytest.raises(MissingPackage, match=escape(f"{needs}; {remedy_for_extra('sim')}")):
        Robot.from_mjcf(arm())


def test_damping_and_frictionloss_are_read_with_the_defaults_of_their_class():
    text = arm().replace(
        "<worldbody>", '<default><joint damping="2" frictionloss="0.4"/></default><worldbody>'
    )
    robot = Robot.from_mjcf(text.replace('axis="1 1 0"', 'axis="1 1 0" damping="3"'), limits={"v_max": 1.0})
    assert robot.viscous.tolist() == [2.0, 3.0]
    assert robot.coulomb.tolist() == [0.4, 0.4]


CUP = '<body name="cup" pos="1 0 0"><freejoint/><geom size=".05" mass=".2"/></body>'


def test_keyframe_of_a_scene_is_a_posture_of_the_arm_and_its_objects_are_no_tips():
    text = arm(things=CUP, more='<keyframe><key name="home" qpos=".1 .2 0 0 0 1 0 0 0"/></keyframe>')
    robot = Robot.from_mjcf(text, limits={"v_max": 1.0})
    assert robot.joints == ("a", "b")
    assert robot.neutral.tolist() == [0.1, 0.2]


def test_free_base_is_held_at_its_place():
    text = arm().replace('<body name="one" pos="0 0 0.3">', '<body pos="1 0 0"><freejoint name="float"/>'
                         '<geom size=".1"/><body name="one" pos="0 0 0.3">')  # fmt: skip
    text = text.replace("</body></body>", "</body></body></body>")
    robot = Robot.from_mjcf(text, limits={"v_max": 1.0})
    assert robot.joints == ("a", "b")
    assert robot.pose([0.0, 0.0])[:3, 3] == pytest.approx([1.1, 0.0, 0.6])
    assert "the free joint 'float' is held at its place in the file" in sentences(text)
    assert Robot.from_mjcf(text, tip="tcp", locked=["float"], limits={"v_max": 1.0}).joints == ("a", "b")


def test_frame_with_a_name_can_be_the_tip():
    text = arm().replace('<site name="tcp" pos="0.1 0 0"/>', '<frame name="grip" pos="0 0 0.2"/>')
    robot = Robot.from_mjcf(text, tip="grip", limits={"v_max": 1.0})
    assert robot.pose([0.0, 0.0])[:3, 3] == pytest.approx([0.0, 0.0, 0.8])


def test_joints_without_names_are_called_after_their_bodies():
    text = arm().replace('name="a" ', "").replace('name="b" type="slide"', '/><joint type="slide"')
    assert Robot.from_mjcf(text, limits={"v_max": 1.0}).joints == ("one_joint", "two_joint", "two_joint 2")


FIXED = '<fixed name="t"><joint joint="a" coef="1"/></fixed>'
ROPE = '<body name="rope"><freejoint/><geom size=".1"/></body>'
BESIDE = {
    "gravcomp carries the weight of 'two' in MuJoCo": ('body name="two"', 'body name="two" gravcomp="1"'),
    "joint 'b' has a spring (stiffness 5)": ('axis="1 1 0"', 'axis="1 1 0" stiffness="5"'),
    "joint 'b' has a range that its limited": ('range="0.1 0.4"', 'range="0.1 0.4" limited="false"'),
    "the ball joint 'c' swings on the arm and is held here": (
        '<site name="tcp"',
        '<body><joint name="c" type="ball"/><geom size=".1"/></body><site name="tcp"',
    ),
    "a medium with a density of 1.2": ("<worldbody>", '<option density="1.2"/><worldbody>'),
    "the tendon 't' moves the arm (stiffness)": (
        "</mujoco>",
        f"<tendon>{FIXED}</tendon></mujoco>".replace('"t"', '"t" stiffness="1"'),
    ),
    "the tendon 't' moves the arm (an actuator)": (
        "</mujoco>",
        f'<tendon>{FIXED}</tendon><actuator><motor tendon="t"/></actuator></mujoco>',
    ),
    "the equality 'tie' (tendon) of 't' closes a loop": (
        "</mujoco>",
        f'<tendon>{FIXED}</tendon><equality><tendon name="tie" tendon1="t"/></equality></mujoco>',
    ),
    "the equality 'grip' (weld) of 'two' and 'world' closes a loop": (
        "</mujoco>",
        '<equality><weld name="grip" body1="two"/></equality></mujoco>',
    ),
    "the equality 'hook' (connect) of 'rope' and 'two' closes a loop": (
        "</worldbody>",
        f'{ROPE}</worldbody><equality><connect name="hook" body1="rope" body2="two" anchor="0 0 0"/>'
        "</equality>",
    ),
    "the actuator 'jet' pushes at body 'two'": (
        "</mujoco>",
        '<actuator><motor name="jet" site="tcp" gear="1 0 0 0 0 0"/></actuator></mujoco>',
    ),
}


@pytest.mark.parametrize("said", BESIDE)
def test_what_moves_the_arm_beside_its_motors_is_a_finding(said):
    assert said not in sentences(arm())
    assert said in sentences(arm().replace(*BESIDE[said]))


def test_mesh_of_a_body_with_an_inertial_need_not_be_there():
    mesh = '<asset><mesh name="m" file="nowhere.stl"/><texture name="t" type="2d" file="no.png"/></asset>'
    text = arm(more=mesh).replace("<site", '<geom type="mesh" mesh="m"/><site')
    assert Robot.from_mjcf(text, limits={"v_max": 1.0}).joints == ("a", "b")
    with pytest.raises(
        InputError, match=r"'nowhere.stl'; put that file where .* <inertial>, with which no mesh"
    ):
        Robot.from_mjcf(text.replace("<inertial", "<!-- <inertial").replace('0.005"/>', '0.005"/> -->'))


MOTORS = """<mujoco>{settings}<worldbody>
<body name="one"><inertial pos="0 0 0.1" mass="2" diaginertia="0.01 0.01 0.005"/>
<joint name="a" axis="0 0 1" range="-1 1" {more}/>
<body name="two" pos="0 0 0.3"><inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.005"/>
<joint name="b" axis="0 1 0" range="-1 1"/><site name="tcp" pos="0.1 0 0"/></body></body>
</worldbody><actuator>{actuators}</actuator></mujoco>"""
CLASSES = """<default><default class="big"><general biastype="affine" forcerange="-87 87"/>
<default class="small"><position forcerange="-12 12"/></default></default></default>"""


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
        (
            '<motor joint="a" ctrlrange="-3 3" ctrllimited="true"/>',
            '<compiler autolimits="false"/>',
            [3.0, np.inf],
        ),
        ('<motor joint="a" ctrlrange="-3 3" ctrllimited="false"/>', "", [np.inf, np.inf]),
    ],
)
def test_the_most_that_actuators_give(actuators, settings, expected):
    on = ' limited="true"' if "autolimits" in settings else ""
    text = MOTORS.format(actuators=actuators, settings=settings, more="").replace('"-1 1"', f'"-1 1"{on}')
    assert Robot.from_mjcf(text, limits={"v_max": 1.0}).limits.tau_max.tolist() == expected
