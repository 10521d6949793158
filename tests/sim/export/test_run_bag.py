"""A run as a bag, read back by mcap and mcap-ros2-support, which share no code with rosbags."""

import os
from collections import defaultdict

import numpy as np
import pytest
from tests.sim.export.conftest import COUNT, DT, NAMES, numbers, signals

import ftqp
from ftqp.control.planner.status import STATUSES
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot
from ftqp.sim.export.run_bag import write_bag
from ftqp.sim.log.log_file import open_log

pytest.importorskip("rosbags", reason='needs the extra "ros": pip install -e ".[ros]"')
reader = pytest.importorskip("mcap.reader", reason="needs mcap, which the extra 'dev' brings")
yaml = pytest.importorskip("ruamel.yaml", reason="comes with rosbags")
decoder = pytest.importorskip("mcap_ros2.decoder", reason="needs mcap-ros2-support, of the extra 'dev'")

FROM = ("a", "tau", "tau_brake", "lb", "ub")


def exported(file, folder, robot=None, told=lambda share: None):
    rows = open_log(file)
    return write_bag(rows, folder, robot, told)


def read(folder):
    """Messages by topic, each with its time [ns]."""
    found = defaultdict(list)
    with (folder / f"{folder.name}.mcap").open("rb") as stream:
        found_by = reader.make_reader(stream, decoder_factories=[decoder.DecoderFactory()])
        for _, channel, message, decoded in found_by.iter_decoded_messages():
            found[channel.topic].append((message.log_time, decoded))
    return found


def same_bits(found, expected):
    found, expected = (np.ascontiguousarray(x, dtype=np.float64) for x in (found, expected))
    np.testing.assert_array_equal(found.view(np.uint64), expected.view(np.uint64))


def joints(table, group):
    return np.stack([table[f"{group}.{name}"] for name in NAMES], axis=1)


@pytest.fixture(scope="module")
def folder(write_to, arm, tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    file, table = write_to(folder, signals(), numbers(signals()))
    return folder / "bag", table, exported(file, folder / "bag", arm)


@pytest.fixture(scope="module")
def bag(folder):
    found = read(folder[0])
    assert folder[2] == sum(map(len, found.values()))
    return found, folder[1]


@pytest.mark.long
@pytest.mark.parametrize(
    ("topic", "position", "velocity", "effort"),
    [
        ("/joint_states", "q", "v", "tau_measured"),
        ("/joint_command", "q_command", "v_command", "tau"),
        ("/joint_measured", "q_measured", "v_measured", None),
        ("/joint_reference", "q_reference", "v_reference", None),
    ],
)
def test_joints_are_equal_bit_by_bit(bag, topic, position, velocity, effort):
    messages = [message for _, message in bag[0][topic]]
    assert len(messages) == COUNT
    assert all(list(message.name) == list(NAMES) for message in messages)
    same_bits([message.position for message in messages], joints(bag[1], position))
    same_bits([message.velocity for message in messages], joints(bag[1], velocity))
    if effort is None:
        assert all(len(message.effort) == 0 for message in messages)
    else:
        same_bits([message.effort for message in messages], joints(bag[1], effort))


@pytest.mark.parametrize("group", ["target", "tip"])
def test_poses_are_equal_bit_by_bit_and_in_the_inertial_frame(bag, group):
    poses = [message.pose for _, message in bag[0][f"/{group}"]]
    found = [[p.position.x, p.position.y, p.position.z] for p in poses]
    same_bits(found, np.stack([bag[1][f"{group}.{x}"] for x in "xyz"], axis=1))
    turned = [[p.orientation.x, p.orientation.y, p.orientation.z, p.orientation.w] for p in poses]
    same_bits(turned, np.stack([bag[1][f"{group}.q{x}"] for x in "xyzw"], axis=1))
    assert {message.header.frame_id for _, message in bag[0][f"/{group}"]} == {"world"}


def test_step_has_every_number_of_the_log(bag):
    messages = [message for _, message in bag[0]["/ftqp/step"]]
    for name in ("position_error", "slack", "qp_residual", "step_time", "sigma_min", "kappa", "progress"):
        same_bits([getattr(message, name) for message in messages], bag[1][name])
    for name in ("status", "qp_status", "qp_iterations", "path_status"):
        assert [getattr(message, name) for message in messages] == bag[1][name].tolist()
    for field, group in zip(("acceleration", "torque", "brake_torque", "lower", "upper"), FROM, strict=True):
        same_bits([getattr(message, field) for message in messages], joints(bag[1], group))
    for name in ("belief", "truth"):
        np.testing.assert_array_equal([getattr(m, name) for m in messages], joints(bag[1], name))


def test_step_has_soft_tasks_and_kept_points_by_name(bag):
    messages = [message for _, message in bag[0]["/ftqp/step"]]
    assert list(messages[0].task_name) == ["look at <b>", "elbow.z"]
    assert list(messages[0].kept_name) == ["Tisch ä"]
    expected = np.stack([bag[1][f"task_error.{name}"] for name in messages[0].task_name], axis=1)
    same_bits([message.task_error for message in messages], expected)
    same_bits([message.distance for message in messages], bag[1]["distance.Tisch ä"][:, None])


def test_codes_are_named_in_the_file(folder):
    with (folder[0] / "bag.mcap").open("rb") as stream:
        schemas = reader.make_reader(stream).get_summary().schemas.values()
    (text,) = [schema.data.decode() for schema in schemas if schema.name == "ftqp_msgs/msg/Step"]
    for code, status in enumerate(STATUSES):
        assert f"int32 STATUS_{status.name}={code}\n" in text
    assert "int32 JOINT_HEALTHY=0\n" in text


def pose_of(transform):
    x, y, z, w = (getattr(transform.rotation, name) for name in "xyzw")
    result = np.eye(4)
    result[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    result[:3, 3] = [getattr(transform.translation, name) for name in "xyz"]
    return result


def test_frames_lead_from_the_world_to_the_tip(bag, arm):
    q = joints(bag[1], "q")
    assert len(bag[0]["/tf"]) == COUNT
    for k in range(0, COUNT, 50):
        frames = bag[0]["/tf"][k][1].transforms
        names = [frames[0].header.frame_id, *(frame.child_frame_id for frame in frames)]
        assert names == ["world", "base", *(f"{name}_link" for name in NAMES), arm.tip]
        assert [frame.header.frame_id for frame in frames] == names[:-1]
        same_bits(
            [getattr(frames[0].transform.translation, x) for x in "xyz"],
            [bag[1][f"base.{x}"][k] for x in "xyz"],
        )
        found = np.linalg.multi_dot([pose_of(frame.transform) for frame in frames[1:]])
        np.testing.assert_allclose(found, arm.pose(q[k]), rtol=0.0, atol=1e-14)


def test_frames_of_a_robot_with_two_tips_lead_to_both(tmp_path):
    robot = ftqp.robots.load("dual_panda")
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.05, duration=0.1)
    planner = ftqp.Planner(robot, dt=5e-3)
    ftqp.Simulation(planner, path, q=robot.neutral, log=tmp_path / "log.npy").run()
    exported(tmp_path / "log.npy", tmp_path / "bag", robot)
    messages, q = read(tmp_path / "bag")["/tf"], ftqp.load_log(tmp_path / "log.npy")["q"]
    assert len(messages) == len(q)
    for (_, message), row in zip(messages, q, strict=True):
        placed = {"base": np.eye(4)}
        for frame in message.transforms:
            placed[frame.child_frame_id] = placed[frame.header.frame_id] @ pose_of(frame.transform)
        for tip in robot.tips:
            np.testing.assert_allclose(placed[tip], robot.pose(row, tip), rtol=0.0, atol=1e-14)


def test_description_is_the_arm_and_is_kept_for_late_comers(bag, arm, folder):
    ((time, message),) = bag[0]["/robot_description"]
    assert time == 0
    again = Robot.from_urdf(message.data)
    np.testing.assert_allclose(again.pose(arm.neutral), arm.pose(arm.neutral), atol=1e-14)
    about = yaml.YAML(typ="safe").load((folder[0] / "metadata.yaml").read_text())[
        "rosbag2_bagfile_information"
    ]
    kept = {
        topic["topic_metadata"]["name"]: topic["topic_metadata"]["offered_qos_profiles"][0]["durability"]
        for topic in about["topics_with_message_count"]
    }
    assert kept.pop("/robot_description") == "transient_local"
    assert set(kept.values()) == {"volatile"}
    assert about["message_count"] == sum(map(len, bag[0].values()))


def test_status_is_said_in_words_where_it_changes(bag):
    codes = bag[1]["status"]
    changes = np.flatnonzero(np.diff(codes, prepend=-1.0))
    assert 1 < len(changes) < 20
    assert [time for time, _ in bag[0]["/ftqp/status"]] == [round(1e9 * DT * k) for k in changes]
    words = [f"{STATUSES[int(code)].name}: {STATUSES[int(code)].value}" for code in codes[changes]]
    assert [message.data for _, message in bag[0]["/ftqp/status"]] == words


def test_every_stamp_is_the_time_of_its_message(bag):
    for topic in ("/joint_states", "/tip", "/ftqp/step"):
        for k, (time, message) in enumerate(bag[0][topic]):
            assert time == round(1e9 * DT * k)
            assert 10**9 * message.header.stamp.sec + message.header.stamp.nanosec == time


@pytest.mark.long
@pytest.mark.parametrize(("level", "share"), [("acceleration", 0.5), ("velocity", 1.0)])
def test_command_is_integrated_where_the_log_does_not_have_it(write, tmp_path, level, share):
    few = signals(sensed=(), base=())
    file, table = write(few, numbers(few), level=level)
    exported(file, tmp_path / "bag")
    found = read(tmp_path / "bag")
    q, v, a = (joints(table, group) for group in "qva")
    command = [message for _, message in found["/joint_command"]]
    same_bits([message.velocity for message in command], v + DT * a)
    np.testing.assert_allclose([m.position for m in command], q + DT * v + share * DT**2 * a, rtol=1e-14)
    assert sorted(found) == [
        "/ftqp/status", "/ftqp/step", "/joint_command", "/joint_states", "/target", "/tip"
    ]  # fmt: skip
    assert {message.header.frame_id for _, message in found["/tip"]} == {"base"}
    assert all(len(message.effort) == 0 for _, message in found["/joint_states"])


def test_nothing_is_overwritten(write, tmp_path):
    file, _ = write(signals(), numbers(signals(), 5))
    (tmp_path / "bag").mkdir()
    with pytest.raises(InputError, match=r"folder .*bag exists, and nothing is overwritten"):
        exported(file, tmp_path / "bag")
    with pytest.raises(InputError, match="cannot be written"):
        exported(file, tmp_path / "none" / "bag")
    assert sorted(os.listdir(tmp_path)) == ["bag", "log.json", "log.npy"]


def test_ctrl_c_leaves_nothing(write, tmp_path):
    def stop(share):
        raise KeyboardInterrupt

    file, _ = write(signals(), numbers(signals(), 300))
    with pytest.raises(KeyboardInterrupt):
        exported(file, tmp_path / "bag", told=stop)
    assert set(os.listdir(tmp_path)) == {"log.npy", "log.json"}
