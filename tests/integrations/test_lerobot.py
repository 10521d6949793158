"""The package for LeRobot, against stand-ins of its classes: LeRobot is not installed here."""

import importlib
import inspect
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from tests.vendors.fake_servos import STEP, FakeServo

import ftqp

FOLDER = Path(__file__).parents[2] / "integrations" / "lerobot"
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


class StandInBus:
    """What is used of LeRobot 0.6's ``FeetechMotorsBus``, over the registers of simulated servos."""

    def __init__(self, port, motors, calibration):
        self.port, self.motors, self.calibration = port, motors, calibration
        self.servos = {motor.id: FakeServo("feetech") for motor in motors.values()}
        serial = SimpleNamespace(reset_input_buffer=lambda: self.cleared.append(1))
        self.port_handler = SimpleNamespace(ser=serial)
        self.sync_reader = SimpleNamespace(txRxPacket=self._ask, getData=self._data)
        self.cleared, self.missed = [], 0

    def _setup_sync_reader(self, ids, address, length):
        self.asked = address, length

    def _ask(self):
        self.missed -= 1
        self.answers = {one: servo.answer(*self.asked) for one, servo in self.servos.items()}
        return -1 if self.missed >= 0 else 0

    def _data(self, one, address, size):
        begin = address - self.asked[0]
        return int.from_bytes(self.answers[one][begin : begin + size], "little")

    def _is_comm_success(self, code):
        return code == 0

    def _decode_sign(self, name, told):
        return told

    def _normalize(self, told):
        return {one: np.rad2deg((value - 2048) * STEP) for one, value in told.items()}

    def sync_read(self, data_name, motors=None, *, normalize=True, num_retry=0):
        raise AssertionError("one answer has all that is read here")

    def sync_write(self, data_name, values, *, normalize=True):
        for name, value in values.items():
            servo = self.servos[self.motors[name].id]
            if data_name == "Goal_Position":
                servo.put("goal", round(np.deg2rad(value) / STEP) + 2048 if normalize else value)
            elif value:
                servo.switch_on()
            else:
                servo.put("torque", 0)

    def live(self, dt):
        for servo in self.servos.values():
            servo.live(dt)


class StandInFollower:
    """What is used of LeRobot 0.6's ``SOFollower``."""

    def __init__(self, config):
        self.config = config
        motors = {name: SimpleNamespace(id=i) for i, name in enumerate([*NAMES, "gripper"], 1)}
        self.bus = StandInBus(config.port, motors, {})

    def get_observation(self):
        told = self.bus.sync_read("Present_Position", num_retry=2)
        return {f"{name}.pos": value for name, value in told.items()}

    def send_action(self, action):
        goals = {key.removesuffix(".pos"): value for key, value in action.items()}
        self.bus.sync_write("Goal_Position", goals)
        return {f"{name}.pos": value for name, value in goals.items()}


class StandInConfig:
    known: dict = {}  # noqa: RUF012

    @classmethod
    def register_subclass(cls, name):
        return lambda config: cls.known.setdefault(name, config)


@dataclass
class StandInFollowerConfig:
    port: str
    use_degrees: bool = True


@pytest.fixture(scope="module")
def package():
    """``lerobot_robot_ftqp`` beside stand-ins of the modules of LeRobot that it uses."""
    held = {
        "lerobot": {}, "lerobot.robots": {}, "lerobot.motors": {},
        "lerobot.robots.config": {"RobotConfig": StandInConfig},
        "lerobot.robots.so_follower": {
            "SOFollower": StandInFollower, "SOFollowerConfig": StandInFollowerConfig,
        },
        "lerobot.motors.feetech": {"FeetechMotorsBus": StandInBus},
    }  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        for name, values in held.items():
            module = ModuleType(name)
            vars(module).update(values)
            patch.setitem(sys.modules, name, module)
        patch.syspath_prepend(str(FOLDER / "src"))
        yield importlib.import_module("lerobot_robot_ftqp")
        for name in [one for one in sys.modules if one.startswith("lerobot_robot_ftqp")]:
            del sys.modules[name]


@pytest.fixture(scope="module")
def adapter(package):
    return importlib.import_module("lerobot_robot_ftqp.kinematics").RobotKinematics


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


def test_a_processor_that_hands_back_its_own_command_is_told_what_was_measured(adapter, urdf):
    kinematics, q = adapter(urdf, "grip", NAMES), START.copy()
    pose = kinematics.forward_kinematics(q)
    pose[:3, 3] += [0.0, 0.05, 0.0]
    for _ in range(30):  # the arm stands meanwhile
        kinematics.observe(START)
        q = kinematics.inverse_kinematics(q, pose)
    assert kinematics.step.status is not ftqp.StepStatus.OK
    kinematics.reset()
    moved = START + 5.0
    assert (
        np.abs(kinematics.inverse_kinematics(moved, kinematics.forward_kinematics(moved)) - moved).max() < 0.1
    )


@pytest.fixture
def robot(package, urdf):
    """The robot, with its servos at START."""
    made = package.SO101Ftqp(package.SO101FtqpConfig(port="/dev/null", urdf=str(urdf), tip="grip"))
    for servo, angle in zip(made.bus.servos.values(), np.deg2rad(START), strict=True):
        servo.place = float(angle)
        for name in ("position", "goal"):
            servo.put(name, round(angle / STEP) + 2048)
    return made


def test_lerobot_finds_the_package_by_its_name_and_the_robot_by_its_configuration(package):
    told = tomllib.loads((FOLDER / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert told["name"].startswith("lerobot_robot_") and told["name"] == package.__name__
    config = StandInConfig.known["so101_ftqp"]
    module, name = config.__module__, config.__name__
    assert module.split(".")[-1].startswith("config_") and name.endswith("Config")
    found = getattr(sys.modules[module.rpartition(".")[0]], name.removesuffix("Config"))
    assert found is package.SO101Ftqp and found.name == "so101_ftqp" and found.config_class is config


def circled(robot, failure=None):
    """How far the gripper is off a circle of joint angles at 30 Hz in the end [m], and what was sent."""
    reference, q, off, sent = robot.kinematics, START.copy(), [], {}
    adapter = type(robot.kinematics)
    policy = adapter(robot.config.urdf, "grip", NAMES)
    pose = policy.forward_kinematics(q)
    centre = pose[:3, 3].copy()
    for k in range(400):
        if k == 100 and failure is not None:
            failure(robot)
        angle = 2.0 * np.pi * k / 240
        pose[:3, 3] = centre + min(1.0, k / 60) * 0.02 * np.array([0.0, np.sin(angle), 1.0 - np.cos(angle)])
        q = policy.inverse_kinematics(q, pose)
        robot.get_observation()
        action = dict(zip([f"{name}.pos" for name in [*NAMES, "gripper"]], map(float, q), strict=True))
        sent = robot.send_action(action)
        robot.bus.live(1.0 / 30.0)
        there = np.array([np.rad2deg(servo.place) for servo in robot.bus.servos.values()])
        if k > 200:
            off.append(np.linalg.norm(reference.forward_kinematics(there)[:3, 3] - pose[:3, 3]))
    return max(off), sent, action


def overload(robot):
    servo = robot.bus.servos[4]
    servo.jammed = True
    servo.put("status", 0x20)


def test_before_a_failure_the_angles_go_to_the_servos_as_they_come(robot):
    off, sent, action = circled(robot)
    assert sent == action and off < 3e-3 and not robot.kinematics.planner.faults


def test_after_an_overload_the_other_servos_lead_the_gripper_to_what_the_angles_mean(robot):
    off, sent, action = circled(robot, overload)
    assert set(robot.kinematics.planner.faults) == {"wrist_flex"}
    assert sent != action and sent["gripper.pos"] == action["gripper.pos"]
    assert off < 3e-3
    servo = robot.bus.servos[4]
    assert not robot.recover("wrist_flex") and set(robot.kinematics.planner.faults) == {"wrist_flex"}
    servo.jammed = False
    assert robot.recover("wrist_flex") and not robot.kinematics.planner.faults
    assert servo.switched_on_far == [False, False] and servo.at("torque")


def test_a_hot_servo_waits_for_a_person(robot):
    robot.bus.servos[3].put("status", 0x04)
    for _ in range(3):
        robot.get_observation()
    with pytest.raises(
        ftqp.InputError, match=r"elbow_flex: find the cause.*then robot\.repaired\('elbow_flex'\)"
    ):
        robot.recover("elbow_flex")
    robot.bus.servos[3].put("status", 0)
    robot.repaired("elbow_flex")
    assert not robot.kinematics.planner.faults


def test_an_undefined_status_holds_the_arm(robot):
    robot.bus.servos[2].put("status", 0x40)
    asked = {f"{name}.pos": float(value) + 10.0 for name, value in zip(NAMES, START, strict=False)}
    for _ in range(30):
        robot.get_observation()
        sent = robot.send_action(asked)
    assert robot.watch.arm == "paused"
    assert all(abs(sent[key] - asked[key] + 10.0) < 0.1 for key in asked)


def test_a_missed_answer_is_asked_for_anew_and_every_question_with_an_empty_input(robot):
    robot.bus.missed = 2
    assert robot.get_observation()["gripper.pos"] == pytest.approx(12.0, abs=0.1)
    assert len(robot.bus.cleared) == 3 and robot.bus.temperature["elbow_flex"] == 35
    robot.bus.missed = 3
    with pytest.raises(ConnectionError, match=r"no whole answer from the servos .* after 3 tries"):
        robot.get_observation()


def test_what_the_robot_cannot_do_without_is_said(package, urdf):
    for given, words in (
        ({"urdf": ""}, "urdf is empty"),
        ({"urdf": str(urdf), "use_degrees": False}, "use_degrees is False"),
    ):
        with pytest.raises(ftqp.InputError, match=words):
            package.SO101Ftqp(package.SO101FtqpConfig(port="/dev/null", tip="grip", **given))
