"""The table of Universal Robots beside ur_rtde, on a simulated controller in a process of its own."""

import socket
import subprocess
import sys
from pathlib import Path
from time import sleep

import pytest
from tests.going import started

import ftqp

rtde_receive = pytest.importorskip("rtde_receive", reason='needs the extra "dev": pip install -e ".[dev]"')
dashboard_client = pytest.importorskip("dashboard_client")
ROBOT = ftqp.robots.load("puma560")
"""Six joints, as that arm has; the kinematics are no matter here."""
LOCKED_FOR = 0.3
"""How long the simulated protective stop is locked [s], in place of 5."""


class Controller:
    """The maker's clients of a controller, and the watch of a planner."""

    def __init__(self):
        self.received = rtde_receive.RTDEReceiveInterface("127.0.0.1", 125.0)
        self.dashboard = dashboard_client.DashboardClient("127.0.0.1")
        self.dashboard.connect()
        self.faking = socket.create_connection(("127.0.0.1", 29999))
        self.planner = started(ROBOT, dt=0.008, task=ftqp.Task("position"))
        self.watch = ftqp.vendors.Watch(self.planner, "universal_robots")

    def fake(self, what):
        self.faking.sendall(f"fake {what}\n".encode())

    def read(self):
        sleep(0.008)
        words = {
            "safety_status_bits": self.received.getSafetyStatusBits(),
            "robot_mode": self.received.getRobotMode(),
            "joint_mode": self.received.getJointMode(),
        }
        return self.watch.look(words, self.received.getActualQ())

    def until(self, condition):
        for _ in range(1000):
            self.read()
            if condition():
                return
        raise AssertionError("it did not come in time")

    def again(self, ready):
        """Whether the planner leads again."""
        sent = []
        begins = ftqp.vendors.begin_again(self.planner, self.read, sent.append, ready, watch=self.watch)
        return any(now.leads for now in begins) and len(sent) == 1

    def close(self):
        self.received.disconnect()
        self.dashboard.disconnect()
        self.faking.close()


@pytest.fixture
def controller():
    command = [sys.executable, str(Path(__file__).with_name("fake_ur.py")), str(LOCKED_FOR)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        made = Controller()
        yield made
        made.close()
        process.stdin.close()


def steps_of(recovery, controller):
    """The maker's steps, each taken by the one that it belongs to."""
    while (step := recovery.next) is not None:
        if step.by == "program":
            with pytest.raises(ftqp.InputError, match="not of a person"):
                recovery.done("person")
        if "unlockProtectiveStop" in step.do:
            with pytest.raises(RuntimeError, match="Cannot unlock protective stop"):
                controller.dashboard.unlockProtectiveStop()  # not before its time
            sleep(step.after * LOCKED_FOR / 5.0)
            controller.dashboard.unlockProtectiveStop()
        for call in ("restartSafety", "powerOn", "brakeRelease"):
            if call in step.do:
                getattr(controller.dashboard, call)()
        recovery.done(step.by)


@pytest.mark.slow
def test_a_protective_stop_pauses_and_ends_by_its_steps(controller):
    controller.until(lambda: controller.received.getRobotMode() == 7)
    assert controller.watch.arm == "goes_on" and not controller.watch.standing
    controller.fake("protective_stop")
    controller.until(lambda: controller.watch.arm == "paused")
    assert not controller.planner.faults
    steps_of(controller.watch.recover(), controller)
    assert controller.again(lambda: controller.received.getSafetyStatusBits() == 1)
    assert controller.watch.arm == "goes_on" and not controller.watch.standing


@pytest.mark.slow
def test_a_fault_of_a_joint_switches_the_arm_off_and_names_the_joint(controller):
    controller.until(lambda: controller.received.getRobotMode() == 7)
    controller.fake("joint_fault 2")
    controller.until(lambda: controller.watch.arm == "off" and controller.planner.faults)
    assert set(controller.planner.faults) == {ROBOT.joints[2]}
    steps_of(controller.watch.recover(), controller)
    assert controller.again(lambda: controller.received.getRobotMode() == 7)
    assert not controller.planner.faults and controller.watch.arm == "goes_on"
