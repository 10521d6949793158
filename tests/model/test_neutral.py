"""Where an arm starts: what the model names, or a regular posture in mid-range."""

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError
from ftqp.model.posture import locks
from ftqp.model.robot import Robot

HALF = np.pi / 2

UR5 = [
    (0.0, 0.089159, 0.0, HALF), (0.0, 0.0, -0.425, 0.0), (0.0, 0.0, -0.39225, 0.0), (0.0, 0.10915, 0.0, HALF),
    (0.0, 0.09465, 0.0, -HALF), (0.0, 0.0823, 0.0, 0.0),
]  # fmt: skip
UR10 = [
    (0.0, 0.1273, 0.0, HALF), (0.0, 0.0, -0.612, 0.0), (0.0, 0.0, -0.5723, 0.0), (0.0, 0.163941, 0.0, HALF),
    (0.0, 0.1157, 0.0, -HALF), (0.0, 0.0922, 0.0, 0.0),
]  # fmt: skip
SRS = [
    (0.0, 0.34, 0.0, -HALF), (0.0, 0.0, 0.0, HALF), (0.0, 0.4, 0.0, HALF), (0.0, 0.0, 0.0, -HALF),
    (0.0, 0.4, 0.0, -HALF), (0.0, 0.0, 0.0, HALF), (0.0, 0.126, 0.0, 0.0),
]  # fmt: skip


def made(table, low=-2.0 * np.pi, high=2.0 * np.pi, **more):
    return Robot.from_dh(table, limits={"q_min": low, "q_max": high, "v_max": 2.0}, **more)


def share(robot):
    """sigma_min over the characteristic length at neutral."""
    J = robot.jacobian(robot.neutral) * np.r_[1, 1, 1, [robot.length] * 3][:, None]
    return np.linalg.svd(J, compute_uv=False)[-1] / robot.length


@pytest.mark.parametrize(
    "robot",
    [
        made(UR5), made(UR10), made(UR5, -np.pi, np.pi), made(SRS, -2.5, 2.5), made(UR5, -np.inf, np.inf),
        made(UR5, [-3.0, -2.0, -2.5, -3.0, -1.5, -3.0], [3.0, 1.0, 2.5, 3.0, 2.0, 3.0]),
    ],
    ids=["ur5", "ur10", "ur5 narrow", "srs", "ur5 endless", "ur5 uneven"],
)  # fmt: skip
def test_arm_whose_zero_is_singular_starts_at_a_regular_posture_in_the_middle(robot):
    assert share(robot) > 0.3
    low, high = robot.limits.q_min, robot.limits.q_max
    if np.isfinite(low).all():
        assert (np.minimum(robot.neutral - low, high - robot.neutral) >= 0.12 * (high - low)).all()


def test_posture_that_the_motors_hold_is_preferred(two_joints):
    """Zero is regular, but there the first joint is too weak."""
    text = two_joints(axis="0 1 0", origin="0.3 0 0", limit='lower="-3" upper="3" velocity="1" effort="1"')
    robot = Robot.from_urdf(text)
    assert abs(robot.bias(robot.neutral, np.zeros(2))[0]) < 1.0 < abs(robot.bias(np.zeros(2), np.zeros(2))[0])


SRDF = """<robot name="two"><group_state name="Home" group="arm"><joint name="a" value="0.4"/>
<joint name="b" value="-0.7"/></group_state><group_state name="folded"><joint name="a" value="-0.9"/>
<joint name="b" value="1.9"/></group_state>
<group_state name="half"><joint name="a" value="1"/></group_state></robot>"""


@pytest.mark.parametrize("place", ["arm.srdf", "../srdf/arm.srdf"])
def test_posture_named_home_in_the_srdf_beside_the_urdf_is_neutral(two_joints, tmp_path, place):
    (tmp_path / "urdf").mkdir()
    (tmp_path / "srdf").mkdir()
    file = tmp_path / "urdf" / "arm.urdf"
    file.write_text(two_joints(), encoding="utf-8")
    (file.parent / place).write_text(SRDF, encoding="utf-8")
    robot = Robot.from_urdf(file)
    assert robot.neutral.tolist() == [0.4, -0.7]
    assert "neutral is the posture 'Home' of the model" in [str(finding) for finding in robot.findings]
    assert Robot.from_urdf(file, neutral="folded").neutral.tolist() == [-0.9, 1.9]
    with pytest.raises(InputError, match=r"'fold' is not a posture of two \(did you mean 'folded'\?\)"):
        Robot.from_urdf(file, neutral="fold")
    with pytest.raises(InputError, match="the posture 'half' does not place every joint of two"):
        Robot.from_urdf(file, neutral="half")


MJCF = """<mujoco model="m"><worldbody>
<body name="b"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<joint name="j" type="hinge" axis="0 0 1" range="-90 90"/>
<body name="c" pos="1 0 0"><inertial pos="0.2 0 0" mass="1" diaginertia="1 1 1"/>
<joint name="k" type="hinge" axis="0 0 1" range="-90 90"/><site name="tcp" pos="0.5 0 0"/></body></body>
</worldbody><keyframe><key name="home" qpos="0.3 {k}"/></keyframe></mujoco>"""


def test_keyframe_home_of_an_mjcf_is_neutral_unless_it_is_singular_or_out_of_range():
    def start(k):
        return Robot.from_mjcf(MJCF.format(k=k), limits={"v_max": 1.0}, default_rows=("x", "y")).neutral

    assert start(0.4).tolist() == [0.3, 0.4]
    assert abs(start(0.0)[1]) > 0.3
    assert start(9.0)[0] != 0.3


POSE = ("x", "y", "z", "rx", "ry", "rz")


@pytest.mark.parametrize(
    ("name", "fatal"), [("srs7", ("j4",)), ("panda", ()), ("xarm7", ()), ("iiwa14", ("iiwa_joint_4",))]
)
def test_elbow_between_spherical_shoulder_and_wrist_is_the_only_fatal_lock_of_a_pose(name, fatal):
    assert locks(ftqp.robots.load(name), POSE).fatal == fatal


def test_every_lock_is_fatal_without_redundancy_and_none_said_where_the_task_is_impossible():
    puma = locks(ftqp.robots.load("puma560"), POSE)
    assert puma.possible
    assert len(puma.fatal) == 6
    assert not locks(ftqp.robots.load("planar(4)"), POSE).possible
