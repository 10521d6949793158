"""On the network of ROS 2 without ROS: bytes are those of ROS 2, and nodes hear and are heard."""

import importlib.util
import os
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from tests.app.deployment.conftest import built  # noqa: F401  a fixture

import ftqp
from ftqp.app.deployment.headers import arm_file, arm_header
from ftqp.core.pose import quaternions

FILE = Path(__file__).parents[2] / "integrations" / "dds" / "node.py"
ALONE = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo'/></Interfaces><AllowMulticast>false"
    "</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex><Peers>"
    "<Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>"
)
"""DDS on this machine only."""
DOMAIN = 47
PANDA = ftqp.robots.load("panda")


@pytest.fixture(scope="module")
def node():
    pytest.importorskip("cyclonedds", reason="needs cyclonedds, which the extra 'dev' brings")
    os.environ["CYCLONEDDS_URI"] = ALONE
    spec = importlib.util.spec_from_file_location("dds_node", FILE)
    module = importlib.util.module_from_spec(spec)
    sys.modules["dds_node"] = module
    spec.loader.exec_module(module)
    return module


def test_bytes_of_messages_are_those_of_ros_2(node):
    typesys = pytest.importorskip("rosbags.typesys", reason="needs rosbags, which the extra 'ros' brings")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    kinds = store.types
    stamp = kinds["builtin_interfaces/msg/Time"](sec=12, nanosec=345)
    header = kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="base")
    ours = node.Header(node.Time(12, 345), "base")
    numbers = np.array([0.5, -2.0, 1e-9])
    point = kinds["geometry_msgs/msg/Point"](x=1.0, y=2.0, z=3.0)
    turn = kinds["geometry_msgs/msg/Quaternion"](x=0.0, y=0.6, z=0.0, w=0.8)
    pose = kinds["geometry_msgs/msg/Pose"](position=point, orientation=turn)
    value = kinds["diagnostic_msgs/msg/KeyValue"](key="panda_joint3", value="locked")
    pairs = [
        (
            "geometry_msgs/msg/PoseStamped",
            {"header": header, "pose": pose},
            node.PoseStamped(ours, node.Pose(node.Point(1.0, 2.0, 3.0), node.Quaternion(0.0, 0.6, 0.0, 0.8))),
        ),
        (
            "sensor_msgs/msg/JointState",
            {
                "header": header, "name": ["a", "bcd"], "position": numbers, "velocity": numbers,
                "effort": numbers[:0],
            },
            node.JointState(ours, ["a", "bcd"], numbers.tolist(), numbers.tolist(), []),
        ),
        (
            "diagnostic_msgs/msg/KeyValue",
            {"key": "panda_joint3", "value": "locked"},
            node.KeyValue("panda_joint3", "locked"),
        ),
        ("std_msgs/msg/String", {"data": "panda_joint3"}, node.String("panda_joint3")),
        (
            "diagnostic_msgs/msg/DiagnosticStatus",
            {"level": 2, "name": "ftqp", "message": "stopped", "hardware_id": "", "values": [value]},
            node.DiagnosticStatus(2, "ftqp", "stopped", "", [node.KeyValue("panda_joint3", "locked")]),
        ),
    ]  # fmt: skip
    for kind, fields, message in pairs:
        theirs = bytes(store.serialize_cdr(kinds[kind](**fields), kind))
        length = len(
            theirs
        )  # after the four bytes that say how it is written, of which the last counts padding
        assert message.serialize()[4:length] == theirs[4:], kind
        assert (
            type(message).__idl_typename__
            == kind.replace("/", "::").replace("::msg::", "::msg::dds_::") + "_"
        )


def heard(reader, holds, seconds=60.0):
    """Wait for a message."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for message in reader.take(N=10):
            if holds(message):
                return message
        time.sleep(0.02)
    raise AssertionError("nothing was heard")


@contextmanager
def another_process(command):
    """While entered, it runs, on a network of this machine alone."""
    running = subprocess.Popen(command, env={**os.environ, "CYCLONEDDS_URI": ALONE})
    try:
        yield running
    finally:
        running.terminate()
        running.wait()


class Network:
    """Writers of what a node hears, and readers of what it says."""

    def __init__(self, node, domain):
        network = node.DomainParticipant(domain)

        def topic(name, kind):
            return node.Topic(network, name, kind)

        self.said = {
            what: node.DataWriter(network, topic(f"rt/ftqp/{what}", kind), qos=node.QOS)
            for what, kind in node.HEARD.items()
        }
        self.status = node.DataReader(network, topic("rt/ftqp/status", node.DiagnosticStatus), qos=node.QOS)
        self.joints = node.DataReader(network, topic("rt/joint_states", node.JointState), qos=node.QOS)


def message_to(node, place, pose):
    """A target at a place, turned as a pose is."""
    turn = quaternions(pose[None, :3, :3])[0].tolist()
    return node.PoseStamped(pose=node.Pose(node.Point(*place), node.Quaternion(*turn)))


@pytest.mark.long
def test_a_node_in_another_process_goes_where_it_is_told_and_says_what_has_failed(node):
    with another_process([sys.executable, "-P", FILE, "panda", "--domain", str(DOMAIN), "--seconds", "120"]):
        network = Network(node, DOMAIN)
        heard(network.status, lambda found: found.level == 0)
        pose = PANDA.pose(PANDA.neutral)
        place = pose[:3, 3] + [-0.02, 0.03, 0.0]
        network.said["fault"].write(node.KeyValue("panda_joint3", "locked"))
        network.said["fault"].write(node.KeyValue("panda_joint3", "broken"))
        network.said["target"].write(message_to(node, place, pose))
        heard(network.status, lambda found: node.KeyValue("panda_joint3", "locked") in found.values)
        at = heard(network.joints, lambda found: np.abs(tip(found.position) - place).max() < 1e-4)
        assert at.name == list(PANDA.joints)
        network.said["withdraw"].write(node.String("panda_joint3"))
        heard(network.status, lambda found: "panda_joint3" not in values(found) and found.level == 0)
        network.said["stop"].write(node.Bool(True))
        heard(network.status, lambda found: "stop" in values(found)["stopped_because"] and found.level == 2)
        network.said["stop"].write(node.Bool(False))
        heard(network.status, lambda found: not values(found)["stopped_because"])


def tip(position):
    """Where the tip is."""
    return PANDA.pose(np.array(position))[:3, 3]


def values(found):
    """What a status says, by its keys."""
    return {value.key: value.value for value in found.values}


@pytest.mark.slow
def test_the_controller_behind_dds_of_another_vendor_is_led_over_the_wire(node, built, tmp_path):  # noqa: F811
    """LEFT OUT where Fast DDS (Debian: libfastrtps-dev) is missing."""
    if not Path("/usr/include/fastdds").is_dir():
        pytest.skip("LEFT OUT: no Fast DDS (apt install libfastrtps-dev), so DDS of two vendors is not tried")
    planner = ftqp.Planner(PANDA)
    file = arm_file(planner.deployable(), 7)
    (tmp_path / "arm.ftqp").write_bytes(file)
    (tmp_path / "arm.h").write_text(arm_header(planner, "panda", file, embedded=False))
    folder, program = FILE.parents[1] / "ros2_control", tmp_path / "over_dds"
    headers = (built / "include", tmp_path, folder / "include", folder / "stand_in")
    sources = (
        folder / "src" / "ftqp_controller.cpp",
        folder / "test" / "over_dds.cpp",
        built / "lib" / "libftqp.a",
    )
    libraries = "-lfastrtps", "-lfastcdr", "-lm"
    options = ["-std=c++17", "-O1", *(f"-I{header}" for header in headers)]
    subprocess.run(["g++", *options, *sources, *libraries, "-o", program], check=True)
    with another_process([program, tmp_path / "arm.ftqp", str(DOMAIN + 1), "120"]):
        network = Network(node, DOMAIN + 1)
        heard(network.status, lambda found: found.message == "waits for a target")
        pose = PANDA.pose(PANDA.neutral)
        network.said["fault"].write(node.KeyValue("panda_joint3", "locked"))
        network.said["target"].write(message_to(node, pose[:3, 3] + [-0.02, 0.03, 0.0], pose))
        heard(network.status, lambda found: values(found)["panda_joint3"] == "locked")
        at = heard(network.status, lambda found: float(values(found)["tip_error"]) < 1e-4)
        assert at.level == 1 and at.message != "waits for a target"
        network.said["withdraw"].write(node.String("panda_joint3"))
        heard(network.status, lambda found: values(found)["panda_joint3"] == "healthy")
