"""Arms that begin again after a stop of their maker's, and those of Universal Robots."""

import socket
import subprocess
import sys
from pathlib import Path
from time import sleep

import numpy as np
import pytest
from tests.going import PANDA, started

import ftqp

DT = 0.01
N = PANDA.nv


class Cell:
    """An arm that goes where it is sent while its controller is ready, and what it was sent."""

    def __init__(self, q):
        self.q, self.sent, self.ready = q.copy(), [], True

    def read(self):
        return self.q.copy()

    def send(self, q):
        self.sent.append(q.copy())
        self.q = q.copy()

    def is_ready(self):
        return self.ready


@pytest.mark.long
@pytest.mark.parametrize("stops", [100, pytest.param(1000, marks=pytest.mark.slow)])
def test_stops_end_in_no_jump(stops):
    """The first command is the measured place, whatever moved the arm, and every step keeps its limits."""
    draw = np.random.default_rng(0)
    limits, middle = PANDA.limits, 0.5 * (PANDA.limits.q_min + PANDA.limits.q_max)
    half = 0.5 * (limits.q_max - limits.q_min)
    planner = started(PANDA, dt=DT, task=ftqp.Task("position"), emergency=None)
    for _ in range(stops):
        start = middle + 0.6 * half * draw.uniform(-1.0, 1.0, N)
        cell, target = Cell(start), None
        planner.reset(start)
        away = ftqp.Target(position=PANDA.pose(start)[:3, 3] + draw.uniform(-0.1, 0.1, 3))
        for _ in range(int(draw.integers(1, 15))):
            cell.send(planner.step(cell.read(), None, away).q)
        planner.stop()
        cell.q = np.clip(cell.q + draw.uniform(-1.0, 1.0, N), middle - 0.9 * half, middle + 0.9 * half)
        moved, cell.sent, led = cell.q.copy(), [], 0
        again = ftqp.vendors.begin_again(planner, cell.read, cell.send, cell.is_ready)
        before = np.zeros(N)
        for now in again:
            if cell.sent and led == 0:
                assert np.abs(cell.sent[0] - moved).max() <= 1e-12
            if not now.leads:
                continue
            target = target or ftqp.Target(position=PANDA.pose(cell.q)[:3, 3])
            step = planner.step(cell.read(), None, target)
            v = (step.q - cell.q) / DT
            assert (np.abs(v) <= limits.v_max * (1 + 1e-9) + 1e-12).all()
            assert (np.abs(v - before) <= limits.a_max * DT * (1 + 1e-6) + 1e-12).all()
            before = v
            cell.send(step.q)
            led += 1
            if led == 20:
                break
        again.close()
        assert led == 20


def test_it_waits_until_the_controller_is_ready_and_the_arm_stands():
    """Ready but for a moment from 0.2 s on, moved by hand until 0.5 s, without a number at 0.55 s."""
    planner = started(PANDA, dt=DT, task=ftqp.Task("position"))
    cell, said = Cell(PANDA.neutral), []
    again = ftqp.vendors.begin_again(planner, cell.read, cell.send, cell.is_ready)
    for k in range(100):
        cell.ready = True if k >= 20 and k != 25 else "brakes on"
        cell.q = PANDA.neutral + 0.01 * min(k, 49)
        cell.q[3] = np.nan if k == 55 else cell.q[3]
        said.append(next(again))
        assert bool(cell.sent) == (k >= 66)
        if cell.sent:
            break
    assert said[5].why == said[25].why == "brakes on"
    assert said[40].why == "waits until the arm stands" and said[-1].why == "begins where the arm is"
    assert len(said) == 67 and not any(now.leads for now in said)


def test_speed_rises_in_two_seconds_and_faults_survive():
    planner = started(PANDA, dt=DT, task=ftqp.Task("position"))
    planner.speed = 0.8
    planner.report(ftqp.Locked(2))
    cell, speeds = Cell(PANDA.neutral), []
    for now in ftqp.vendors.begin_again(planner, cell.read, cell.send, cell.is_ready, speed=0.25):
        if now.leads:
            speeds.append(planner.speed)
    assert len(speeds) == 200 and speeds[0] == pytest.approx(0.2) and speeds[-1] == pytest.approx(0.8)
    assert (
        (np.diff(speeds) >= 0.0).all() and planner.speed == 0.8 and set(planner.faults) == {PANDA.joints[2]}
    )


def test_a_controller_that_is_not_ready_any_more_stops_it_and_it_begins_anew():
    planner = started(PANDA, dt=DT, task=ftqp.Task("position"))
    cell, target = Cell(PANDA.neutral), ftqp.Target(position=PANDA.pose(PANDA.neutral)[:3, 3])
    again, said = ftqp.vendors.begin_again(planner, cell.read, cell.send, cell.is_ready), []
    for k in range(250):
        cell.ready = not 60 <= k < 70
        said.append(next(again))
        if k == 60:
            assert planner.step(cell.q, None, target).status is ftqp.StepStatus.STOPPED
    assert [now.why for now in said].count("begins where the arm is") == 2
    assert said[59].leads and not any(now.leads for now in said[60:80]) and said[90].leads
    assert said[60].why == "the controller is not ready" and planner.speed < 1.0
    again.close()
    assert planner.speed == 1.0


def test_it_ends_with_the_last_word_after_a_minute():
    planner = started(PANDA, dt=DT, task=ftqp.Task("position"))
    cell = Cell(PANDA.neutral)
    cell.ready = "emergency stop"
    again = ftqp.vendors.begin_again(planner, cell.read, cell.send, cell.is_ready)
    for k in range(6000):
        now = next(again)
        assert not now.leads and (k < 5999) == (now.why == "emergency stop")
    assert now.why == "not ready for 60 s: emergency stop" and not cell.sent
    with pytest.raises(StopIteration) as ended:
        next(again)
    assert ended.value.value is False


def test_a_repaired_joint_is_withdrawn_and_one_that_stays_bad_stays_reported():
    planner = started(PANDA, dt=DT, task=ftqp.Task("position"), emergency=None)
    watch = ftqp.vendors.Watch(planner, "kinova")
    cell, bad = Cell(PANDA.neutral), {1: 0x2000, 4: 0x1}

    def read():
        words = {"arm_state": 4 if bad else 6, "fault_bank_a": [bad.get(i, 0) for i in range(N)]}
        return watch.look({**words, "warning_bank_a": [0] * N}, cell.q)

    read(), read()
    assert set(planner.faults) == {PANDA.joints[1], PANDA.joints[4]} and watch.arm == "off"
    del bad[1]
    for now in ftqp.vendors.begin_again(planner, read, cell.send, cell.is_ready, watch=watch):
        if now.leads:
            break
    assert set(planner.faults) == {PANDA.joints[4]} and watch.arm == "off"
    bad.clear()
    for now in ftqp.vendors.begin_again(planner, read, cell.send, cell.is_ready, watch=watch):
        if now.leads:
            break
    assert not planner.faults and watch.arm == "goes_on" and watch.standing == ()


@pytest.mark.parametrize("given", ["read", "send", "ready", "watch"])
def test_what_cannot_be_called_is_refused_at_once(given):
    planner, cell = started(PANDA, dt=DT), Cell(PANDA.neutral)
    taken = {"read": cell.read, "send": cell.send, "ready": cell.is_ready, given: 3}
    with pytest.raises(ftqp.InputError, match=f"{given} is 3, expected"):
        ftqp.vendors.begin_again(planner, **taken)


@pytest.mark.parametrize("speed", [0.0, -0.1, 1.5, float("nan")])
def test_a_speed_that_is_no_share_is_refused_at_once(speed):
    planner, cell = started(PANDA, dt=DT), Cell(PANDA.neutral)
    with pytest.raises(ftqp.InputError, match="speed"):
        ftqp.vendors.begin_again(planner, cell.read, cell.send, cell.is_ready, speed=speed)


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
