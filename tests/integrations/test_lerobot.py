"""The adapter for LeRobot, against a stand-in of its interface: the package itself is not installed here."""

import importlib.util
import inspect
from pathlib import Path

import numpy as np
import pytest

import ftqp

FILE = Path(__file__).parents[2] / "integrations" / "lerobot" / "kinematics.py"
NAMES = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"]
AXES = ("0 0 1", "0 1 0", "0 1 0", "0 1 0", "1 0 0")
PLACES = ("0 0 .06", ".03 0 .05", ".028 0 .113", ".135 0 0", ".06 0 0")
START = np.array([0.0, -30.0, 60.0, -20.0, 0.0, 12.0])
"""The joints [deg], and the gripper."""


class StandIn:
    """The signatures of ``lerobot.model.kinematics.RobotKinematics``."""

    def __init__(self, urdf_path, target_frame_name="gripper_frame_link", joint_names=None): ...

    def forward_kinematics(self, joint_pos_deg): ...

    def inverse_kinematics(
        self, current_joint_pos, desired_ee_pose, position_weight=1.0, orientation_weight=0.01
    ): ...


@pytest.fixture(scope="module")
def adapter():
    spec = importlib.util.spec_from_file_location("lerobot_kinematics", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.RobotKinematics


@pytest.fixture
def urdf(tmp_path):
    """A five-joint arm in the size of an SO-101."""
    moments = '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/>'
    mass = f'<inertial><mass value=".1"/>{moments}</inertial>'
    links = "".join(f'<link name="l{i}">{mass}</link>' for i in range(6))
    joints = "".join(
        f'<joint name="{name}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<origin xyz="{PLACES[i]}"/>'
        f'<axis xyz="{AXES[i]}"/><limit lower="-1.9" upper="1.9" velocity="3" effort="3"/></joint>'
        for i, name in enumerate(NAMES)
    )
    fixed = (
        '<joint name="e" type="fixed"><parent link="l5"/><child link="grip"/><origin xyz=".1 0 0"/></joint>'
    )
    tip = f'<link name="grip"/>{fixed}'
    file = tmp_path / "arm.urdf"
    file.write_text(f'<robot name="five">{links}{joints}{tip}</robot>')
    return file


def test_it_has_the_signatures_of_lerobot(adapter):
    for name in ("forward_kinematics", "inverse_kinematics"):
        own, theirs = (inspect.signature(getattr(one, name)).parameters for one in (adapter, StandIn))
        assert [(p.name, p.default) for p in own.values()] == [(p.name, p.default) for p in theirs.values()]
    own = list(inspect.signature(adapter.__init__).parameters.values())
    assert [p.name for p in own[:4]] == ["self", "urdf_path", "target_frame_name", "joint_names"]


@pytest.mark.parametrize("lost", [None, "wrist_flex", "wrist_roll", "elbow_flex"])
def test_a_five_joint_arm_keeps_its_circle_when_a_servo_gives_up(adapter, urdf, lost):
    kinematics, q = adapter(urdf, "grip", NAMES), START.copy()
    pose = kinematics.forward_kinematics(q)
    centre, worst = pose[:3, 3].copy(), 0.0
    for k in range(180):
        angle = 2.0 * np.pi * k / 120
        pose[:3, 3] = centre + min(1.0, k / 60) * 0.02 * np.array([0.0, np.sin(angle), 1.0 - np.cos(angle)])
        if k == 100 and lost is not None:
            kinematics.report_overload(lost)
            stands = q[NAMES.index(lost)]
        q = kinematics.inverse_kinematics(q, pose)
        if k > 110:
            worst = max(worst, np.linalg.norm(kinematics.forward_kinematics(q)[:3, 3] - pose[:3, 3]))
    assert worst < 1e-4 and q[-1] == START[-1] and kinematics.sentence == ftqp.StepStatus.OK.value
    if lost is not None:
        assert abs(q[NAMES.index(lost)] - stands) < 5.0
        kinematics.repaired(lost)
        assert not kinematics.planner.faults


def test_a_target_that_jumps_is_approached_within_the_limits(adapter, urdf):
    kinematics, q = adapter(urdf, "grip", NAMES), START.copy()
    pose = kinematics.forward_kinematics(q)
    pose[:3, 3] += [-0.03, 0.05, 0.03]
    for _ in range(90):
        before, q = q, kinematics.inverse_kinematics(q, pose, orientation_weight=0.0)
        assert (np.abs(np.deg2rad(q - before)) <= 3.0 / 30.0 + 1e-9).all()
    assert np.linalg.norm(kinematics.forward_kinematics(q)[:3, 3] - pose[:3, 3]) < 1e-3


def test_joints_come_in_the_order_of_lerobot_and_an_arm_moved_by_hand_begins_where_it_is(adapter, urdf):
    kinematics = adapter(urdf, "grip", NAMES[::-1])
    other = adapter(urdf, "grip", NAMES)
    q = START[:5]
    assert np.allclose(kinematics.forward_kinematics(q[::-1]), other.forward_kinematics(q))
    kinematics.inverse_kinematics(q[::-1], other.forward_kinematics(q))
    moved = q + 30.0
    sent = kinematics.inverse_kinematics(moved[::-1], other.forward_kinematics(moved))
    assert np.abs(sent[::-1] - moved).max() < 0.5


def test_names_and_angles_that_are_missing_are_said(adapter, urdf):
    with pytest.raises(
        ftqp.InputError, match="joint_names lacks wrist_roll on the way to grip; it has shoulder"
    ):
        adapter(urdf, "grip", NAMES[:4])
    with pytest.raises(
        ftqp.InputError, match=r"joint angles have shape \(3,\), expected one number for each of"
    ):
        adapter(urdf, "grip", NAMES).forward_kinematics(START[:3])
