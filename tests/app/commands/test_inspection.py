"""ftqp inspect: what it says of an arm, in which form, and what it draws."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.app.conftest import invoke as command
from tests.arm_at import arm_at
from tests.telescope import telescope

import ftqp
from ftqp.model.frames import mount_of

URDF = """<robot name="crane"><link name="base"/>
<link name="one"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="two"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link><link name="hand"/>
<joint name="a" type="revolute"><origin xyz="0 0 0.5"/>
<parent link="base"/><child link="one"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="2" velocity="1.5" effort="40"/><dynamics damping="0.5" friction="0.2"/></joint>
<joint name="b" type="revolute"><origin xyz="0.4 0 0"/>
<parent link="one"/><child link="two"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" velocity="2" effort="10"/></joint>
<joint name="c" type="fixed"><origin xyz="0.4 0 0"/>
<parent link="two"/><child link="hand"/></joint></robot>"""


invoke = partial(command, "inspect")


def facts(*arguments: object) -> dict[str, Any]:
    """What it prints, as JSON, without a picture."""
    result = invoke(*arguments, "--json", "--no-figures")
    assert result.exit_code == 0, result.output
    found: dict[str, Any] = json.loads(result.stdout)
    return found


def test_json_of_a_catalog_robot_agrees_with_the_kernel() -> None:
    found, robot = facts("panda"), ftqp.robots.load("panda")
    at = arm_at(robot, robot.neutral)
    scale = np.array([1.0] * 3 + [robot.length] * 3)[:, None]
    assert found["sigma_min"] == pytest.approx(np.linalg.svd(scale * at.J, compute_uv=False)[-1], rel=1e-9)
    assert [joint["gravity"] for joint in found["joints"]] == pytest.approx(np.abs(at.h), abs=1e-9)
    assert found["gravity_margin"] == pytest.approx(1.0 - np.max(np.abs(at.h) / robot.limits.tau_max))
    assert found["redundancy"] == {"pose": 1, "position": 4}
    assert found["structural"] == {"pose": [], "position": []}
    assert found["limits_from"]["a_max"] == "catalog"


def test_file_is_read_with_its_friction_and_the_rule_for_accelerations_is_named(tmp_path: Path) -> None:
    file = tmp_path / "crane.urdf"
    file.write_text(URDF, encoding="utf-8")
    found = facts(file, "--tip", "hand")
    assert found["limits_from"] == {
        "q_min": "file", "q_max": "file", "v_max": "file", "tau_max": "file", "a_max": "rule v_max / 0.2 s",
        "j_max": "file",
    }  # fmt: skip
    assert [joint["viscous"] for joint in found["joints"]] == [0.5, 0.0]
    assert found["friction"] is True
    assert any(finding["sentence"].startswith("joint friction is known") for finding in found["findings"])
    assert found["possible"] == {"pose": False, "position": False}


def test_frames_are_listed_by_the_joint_that_they_move_with(tmp_path: Path) -> None:
    file = tmp_path / "crane.urdf"
    file.write_text(URDF, encoding="utf-8")
    frames = facts(file, "--tip", "hand")["frames"]
    assert frames["two"] == frames["hand"] == frames["b"] == frames["c"] == "b"
    assert frames["one"] == frames["a"] == "a" and frames["base"] is None
    robot = ftqp.Robot.from_urdf(file, tip="hand")
    for name, joint in frames.items():
        assert mount_of(robot, name)[0] == (-1 if joint is None else robot.joints.index(joint))
    said = " ".join(invoke(file, "--tip", "hand", "--no-figures").stdout.split())
    assert "Frames, by the joint that they move with" in said
    assert "b b, two, c, hand" in said and "none universe, base" in said


def test_bodies_are_listed_with_how_much_larger_they_are(tmp_path: Path) -> None:
    box = '<collision><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.06 0.06"/></geometry></collision>'
    (tmp_path / "crane.urdf").write_text(URDF.replace('<link name="one">', f'<link name="one">{box}'))
    found = facts(tmp_path / "crane.urdf", "--capsules")
    (one,) = found["capsules"]
    assert (one["name"], one["frame"], one["estimated"]) == ("one", "one", False)
    assert one["radius"] == pytest.approx(0.03 * np.sqrt(2.0)) and found["pairs_left_out"] == []
    volume = np.pi * one["radius"] ** 2 * (0.4 + 4.0 / 3.0 * one["radius"])
    assert one["volume_ratio"] == pytest.approx(volume / (0.4 * 0.06**2))
    said = invoke("iiwa14", "--capsules", "--no-figures").output
    assert "Bodies as capsules" in said and "estimated" in said
    assert "Built too near to each other to be kept apart: iiwa_joint_7 and iiwa_joint_5." in said


def test_acceleration_by_torque_is_what_pinocchio_moves_with_it() -> None:
    """At the heaviest posture no torque is left over, and nowhere is there less."""
    robot = ftqp.robots.load("panda")
    least = np.array([joint["a_by_torque"] for joint in facts("panda")["joints"]])
    rng = np.random.default_rng(1)
    for q in rng.uniform(robot.limits.q_min, robot.limits.q_max, (50, robot.nv)):
        for i in range(robot.nv):
            a = np.zeros(robot.nv)
            a[i] = 0.8 * least[i]
            tau = robot.mass_matrix(q) @ a + np.abs(robot.bias(q, a * 0.0))
            assert tau[i] <= robot.limits.tau_max[i]


def test_mjcf_is_told_from_urdf_by_its_content(tmp_path: Path) -> None:
    file = tmp_path / "arm.xml"
    file.write_text(
        '<mujoco model="m"><worldbody><body name="b"><inertial pos="0.1 0 0" mass="1" diaginertia="1 1 1"/>'
        '<joint name="j" type="hinge" axis="0 0 1" range="-90 90"/><site name="tcp" pos="0.5 0 0"/></body>'
        "</worldbody></mujoco>",
        encoding="utf-8",
    )
    found = facts(file)
    assert found["robot"] == "m"
    assert found["joints"][0]["v_max"] is None


def test_elbow_of_an_arm_with_spherical_shoulder_and_wrist_is_named(tmp_path: Path) -> None:
    result = invoke("srs7", "--out", tmp_path / "out")
    assert result.exit_code == 0
    assert "Task pose: 1 joint more than rows; no posture survives a lock of j4." in result.stdout
    assert "Task position: 4 joints more than rows; a lock of any one joint can be survived." in result.stdout
    assert "No masses are known" in result.stdout
    assert f"Picture: {tmp_path / 'out' / 'figures' / 'arm.png'}" in result.stdout.replace("\n", "")
    assert (tmp_path / "out" / "figures" / "arm.png").read_bytes().startswith(b"\x89PNG")


def test_arm_without_redundancy_and_one_with_rows_of_its_own_are_told_so() -> None:
    assert facts("puma560")["redundancy"]["pose"] == 0
    found = facts("planar(4)")
    assert found["redundancy"] == {"x, y": 2, "pose": -2, "position": 1}
    assert found["possible"] == {"x, y": True, "pose": False, "position": False}


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("pandaa",), "'pandaa' is not a robot or file of ftqp (did you mean 'panda'?)"),
        (("nowhere.urdf",), "URDF 'nowhere.urdf' does not exist"),
        (
            ("panda", "--tip", "hand"),
            "panda is a robot of the catalog, which has its tip; leave",
        ),
    ],
)
def test_bad_input_exits_2_with_one_sentence(arguments: tuple[str, ...], sentence: str) -> None:
    result = invoke(*arguments)
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert result.stdout == ""


def test_unsafe_robot_exits_2_with_every_finding(tmp_path: Path) -> None:
    file = tmp_path / "crane.urdf"
    file.write_text(URDF.replace('damping="0.5"', 'damping="-1"').replace('velocity="2"', 'velocity="0"'))
    result = invoke(file, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert "viscous friction (damping) of -1" in result.stderr and "zero velocity limit" in result.stderr
    assert not (tmp_path / "out").exists()


def test_survival_says_where_each_joint_can_be_lost() -> None:
    found = facts("panda", "--survival")["survival"]
    assert set(found) == {"pose", "position"}
    assert found["position"]["per_joint"]["panda_joint7"] == 1.0
    assert 0.0 <= found["pose"]["any_joint"] <= min(found["pose"]["per_joint"].values())


def test_a_tip_that_is_still_to_be_chosen_is_asked_for_by_the_option_that_chooses_it(tmp_path: Path) -> None:
    file = tmp_path / "crane.urdf"
    more = '<link name="eye"/><joint name="d" type="fixed"><parent link="two"/><child link="eye"/></joint>'
    file.write_text(URDF.replace("</robot>", f"{more}</robot>"), encoding="utf-8")
    asked = invoke(file, "--no-figures")
    assert asked.exit_code == 2
    assert "unsafe" not in asked.stderr and "tip=" not in asked.stderr
    assert "crane has 2 possible tips; choose one with --tip: hand, eye" in asked.stderr
    assert invoke(file, "--tip", "eye", "--no-figures").exit_code == 0


def test_a_joint_that_cannot_move_is_held_by_the_option_that_is_named(tmp_path: Path) -> None:
    file = tmp_path / "crane.urdf"
    file.write_text(URDF.replace('lower="-1" upper="2"', 'lower="0" upper="0"'), encoding="utf-8")
    refused = invoke(file, "--no-figures")
    assert refused.exit_code == 2 and "hold it with --locked a" in refused.stderr
    assert invoke(file, "--locked", "a", "--no-figures").exit_code == 0


def test_who_mimics_whom_is_said_and_only_motors_count_as_joints_to_spare(tmp_path):
    file = tmp_path / "telescope.urdf"
    file.write_text(telescope(), encoding="utf-8")
    found = facts(file, "--tip", "tool")
    assert found["mimics"]["lift2"] == {"joint": "lift", "ratio": 0.5, "offset": 0.02}
    assert found["redundancy"] == {"pose": 0, "position": 3}
    said = invoke(file, "--tip", "tool", "--no-figures").output
    assert "elbow mimics shoulder: q = -0.7 q + 0.3." in said and "no redundancy" in said
