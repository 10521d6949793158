"""A robot, the robots that are made of it, and the posture in which it begins."""

import numpy as np
import pytest
from tests.arm_at import arm_at

import ftqp
from ftqp.core.errors import InputError, ModelError
from ftqp.model import catalog
from ftqp.model.limits import within_branch
from ftqp.model.posture import locks
from ftqp.model.robot import Robot

PLAIN = {"kind": "continuous", "limit": 'velocity="1.5" effort="20"'}


def test_limits_of_one_joint_are_replaced_by_its_name(two_joints):
    plain = Robot.from_urdf(two_joints())
    robot = Robot.from_urdf(two_joints(), limits={"q_max": {"a": 0.5}, "a_max": {"b": 2.0}})
    np.testing.assert_array_equal(robot.limits.q_max, [0.5, plain.limits.q_max[1]])
    np.testing.assert_array_equal(robot.limits.a_max, [plain.limits.a_max[0], 2.0])
    guess = next(f.sentence for f in robot.findings if "acceleration" in f.sentence)
    assert "a " in guess and "b " not in guess.split("RISE")[0].split(":")[-1]
    again = plain.with_limits(v_max={"b": 0.1})
    np.testing.assert_array_equal(again.limits.v_max, [plain.limits.v_max[0], 0.1])


def test_one_number_that_widens_limits_is_a_finding(two_joints):
    plain = Robot.from_urdf(two_joints())
    wide = Robot.from_urdf(two_joints(), limits={"q_max": 9.0}).findings
    assert any("q_max = 9 for all joints is beyond that of the model for a " in f.sentence for f in wide)
    narrow = Robot.from_urdf(two_joints(), limits={"q_max": 0.5 * plain.limits.q_max.min()}).findings
    assert not any("for all joints is beyond" in f.sentence for f in narrow)
    assert any("v_max = 99 for all" in f.sentence for f in plain.with_limits(v_max=99.0).findings)


def test_pose_of_a_continuous_joint_takes_angles_or_the_configuration(two_joints):
    robot = Robot.from_urdf(two_joints(**PLAIN))
    assert (robot.nq, robot.nv) == (3, 2)
    assert robot.continuous.tolist() == [True, False]
    angles = np.array([2.5, 0.3])
    full = np.array([np.cos(2.5), np.sin(2.5), 0.3])
    assert np.abs(robot.pose(angles) - robot.pose(full)).max() < 1e-15
    assert robot.configuration(angles) == pytest.approx(full, abs=1e-15)
    assert robot.angles(full) == pytest.approx(angles, abs=1e-15)
    assert robot.limits.q_min.tolist() == [-np.inf, -2.0]


def test_given_limits_replace_those_of_the_file_and_of_the_model(two_joints):
    robot = Robot.from_urdf(two_joints(), limits={"v_max": 0.5, "q_max": [0.5, 0.6]})
    assert robot.limits.v_max.tolist() == [0.5, 0.5]
    assert robot.limits.q_max.tolist() == [0.5, 0.6]
    assert robot.limits.tau_max.tolist() == [20.0, 10.0]
    assert robot.model.upperPositionLimit.tolist() == [0.5, 0.6]


def test_branch_limits_narrow_a_range_and_never_widen_it():
    puma = catalog.load("puma560")
    found = within_branch(puma, {"j3": (-1.4, np.inf), 1: (-99.0, 0.5)})
    assert found.limits.q_min[2] == -1.4 and found.limits.q_max[2] == puma.limits.q_max[2]
    assert found.limits.q_min[1] == puma.limits.q_min[1] and found.limits.q_max[1] == 0.5
    np.testing.assert_array_equal(found.limits.q_min[3:], puma.limits.q_min[3:])
    assert np.all((found.neutral >= found.limits.q_min) & (found.neutral <= found.limits.q_max))


def test_held_joint_leaves_the_inertia_matrix_of_the_others_as_it_is():
    robot = catalog.load("panda")
    q = robot.neutral.copy()
    q[3] = -1.2
    held = Robot.from_pinocchio(robot.model, robot.tip, ["panda_joint4"], q_locked={"panda_joint4": -1.2})
    free = [0, 1, 2, 4, 5, 6]
    expected = robot.mass_matrix(q)[np.ix_(free, free)]
    assert held.nv == 6
    assert np.abs(held.mass_matrix(q[free]) - expected).max() < 1e-13 * expected.max()
    assert np.abs(held.pose(q[free]) - robot.pose(q)).max() < 1e-14
    assert held.chain.mass.sum() == pytest.approx(robot.chain.mass.sum())


LOAD = ftqp.Payload(1.5, com=(0.02, -0.03, 0.1), inertia=np.diag([0.01, 0.02, 0.015]))
Q = [0.3, -0.5, 0.4, -1.9, 0.2, 1.6, 0.5]
V = [0.4, -0.3, 0.5, 0.2, -0.6, 0.7, -0.8]


def test_the_heaviest_load_has_torques_that_are_numbers():
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, 1e-3, drive="torque")
    planner.carry(ftqp.Payload(1e6, com=(1e3, 1e3, 1e3), inertia=1e12 * np.eye(3)))
    planner.reset(robot.neutral)
    for _ in range(20):
        step = planner.step(robot.neutral, None, ftqp.Target(pose=robot.pose(robot.neutral)))
        assert (abs(step.tau) <= robot.limits.tau_max).all()
    assert np.isfinite(planner.robot.bias(robot.neutral, V)).all()


def test_load_adds_its_own_kinetic_energy_and_weight():
    """By the bare arm's Jacobian: 1/2 m v_com' v_com + 1/2 w' R I R' w, and m g times the height's slope."""
    bare = ftqp.robots.load("panda")
    empty, full = arm_at(bare, Q, V), arm_at(bare.with_payload(LOAD), Q, V)
    T = bare.pose(Q)
    lever = T[:3, :3] @ LOAD.com
    twist = empty.J @ V
    speed = twist[:3] + np.cross(twist[3:], lever)
    turn = T[:3, :3].T @ twist[3:]
    energy = 0.5 * LOAD.mass * speed @ speed + 0.5 * turn @ LOAD.inertia @ turn
    assert 0.5 * np.array(V) @ (full.M - empty.M) @ V == pytest.approx(energy, rel=1e-10)
    rest_empty, rest_full = arm_at(bare, Q), arm_at(bare.with_payload(LOAD), Q)
    slope = np.array([0.0, 0.0, 9.81 * LOAD.mass])
    pull = empty.J[:3].T @ slope + empty.J[3:].T @ np.cross(lever, slope)
    np.testing.assert_allclose(rest_full.h - rest_empty.h, pull, atol=1e-11)


PANDA = ftqp.robots.load("panda")


def notes(robot):
    return [finding.sentence for finding in robot.findings if finding.about == "friction"]


def test_friction_is_data_of_the_robot_and_its_viscous_part_a_torque():
    rough = PANDA.with_friction(viscous=[1, 2, 3, 4, 5, 6, 7], coulomb=0.3)
    assert rough.viscous.tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert rough.coulomb.tolist() == [0.3] * 7
    v = np.linspace(-0.5, 0.7, 7)
    smooth_arm, rough_arm = arm_at(PANDA, Q, v), arm_at(rough, Q, v)
    np.testing.assert_allclose(rough_arm.h - smooth_arm.h, rough.viscous * v, atol=1e-12)
    np.testing.assert_array_equal(rough_arm.M, smooth_arm.M)
    assert notes(rough) == [
        "joint friction is known: viscous 1 to 7 N m s/rad, Coulomb 0.3 N m; torques count the viscous part; "
        "replace it with robot.with_friction(viscous=..., coulomb=...)",
        *(
            f"joint 'panda_joint{k}' needs {torque} N m against its viscous friction at its speed limit, "
            "beyond its torque limit of 12 N m; correct one of them, "
            "robot.with_friction(viscous=..., coulomb=...)"
            for k, torque in ((5, "13"), (6, "15.7"), (7, "18.3"))
        ),
    ]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("-1", r"joint 'a' has a viscous friction \(damping\) of -1, expected >= 0"),
        ("nan", "joint 'a' has damping or friction that is no finite number"),
        ("much", "joint 'a' has damping or friction that is no finite number"),
    ],
)
def test_urdf_friction_that_is_none_is_refused(two_joints, text, sentence):
    with pytest.raises(ModelError, match=sentence):
        Robot.from_urdf(two_joints(joint=f'<dynamics damping="{text}"/>'))


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
