"""What a ``Watch`` makes of a stream of status words: laws 2 to 6, 8, 10 to 12 of what is promised of it."""

import re
import tracemalloc

import numpy as np
import pytest
from tests.going import PANDA, started, targets_along
from tests.servo_arm import ServoArm
from tests.vendors.fake_servos import FakeServos

import ftqp

DT = 0.01
N = PANDA.nv
NAMES = PANDA.joints


def watched(table="feetech", robot=PANDA, **given):
    planner = started(robot, dt=DT, task=ftqp.Task("position"), emergency=None)
    return planner, ftqp.vendors.Watch(planner, table, **given)


def status(place=None, value=0x20):
    return {"status": [value if i == place else 0 for i in range(N)]}


def error(place=None, value=0x20):
    return {"hardware_error": [value if i == place else 0 for i in range(N)]}


def looked(watch, *samples, q=PANDA.neutral):
    """The news of each sample: their sentences."""
    found = []
    for sample in samples:
        watch.look(sample, q)
        found.append([one.why for one in watch.news])
    return found


def test_a_fault_counts_at_the_second_answer_and_is_said_once():
    planner, watch = watched()
    assert [len(one) for one in looked(watch, *[status(2)] * 5)] == [0, 1, 0, 0, 0]
    assert planner.faults == {NAMES[2]: ftqp.Locked(NAMES[2])} and watch.arm == "goes_on"


def test_a_bit_that_comes_and_goes_in_one_answer_changes_nothing():
    planner, watch = watched()
    news = looked(watch, status(2), status(), status(2), status(), status(3), status(2), status())
    assert not any(news) and not planner.faults and watch.standing == ()


def test_a_fault_counts_only_where_no_undefined_bit_is_set_beside_it():
    planner, watch = watched()
    looked(watch, status(2, 0x20), status(2, 0x60), status(2, 0x20))
    assert not planner.faults and watch.arm == "goes_on"
    looked(watch, status(2, 0x60), status(2, 0x60))
    assert not planner.faults and watch.arm == "paused" and "96 (0x60)" in watch.standing[0].why


def test_a_reported_fault_stays_when_its_bit_has_gone_and_ends_by_the_user():
    planner, watch = watched()
    looked(watch, *[status(2)] * 2, *[status()] * 300)
    assert NAMES[2] in planner.faults and watch.standing
    watch.withdraw(NAMES[2])
    assert not planner.faults and watch.standing == ()


def test_a_restored_joint_that_fails_again_is_reported_again():
    planner, watch = watched()
    looked(watch, *[status(2)] * 3)
    watch.withdraw(NAMES[2])
    assert [len(one) for one in looked(watch, status(2), status(2), status(2))] == [0, 1, 0]
    assert NAMES[2] in planner.faults


def stream(seed):
    draw = np.random.default_rng(seed)
    bits, held = np.array([0, 0, 0, 0x20, 0x04, 0x40, 0x01, 0x22]), 1
    word = np.zeros(N, int)
    for _ in range(400):
        held -= 1
        if held == 0:
            word, held = draw.choice(bits, N) * (draw.random(N) < 0.1), int(draw.integers(1, 6))
        yield None if draw.random() < 0.1 else {"status": word.copy()}


@pytest.mark.parametrize("seed", range(3))
def test_one_recorded_stream_gives_the_same_reports_in_the_same_ticks(seed):
    """The words come as arrays here, as lists and as tuples."""
    told = []
    for form in (np.array, list, tuple):
        planner, watch = watched()
        said = []
        for k, one in enumerate(stream(seed)):
            watch.look(None if one is None else {"status": form(one["status"])}, PANDA.neutral)
            said += [(k, new.why) for new in watch.news]
        told.append((said, planner.faults, watch.arm))
    assert told[0] == told[1] == told[2] and len(told[0][0]) > 3


def test_a_word_that_is_written_in_place_is_seen():
    planner, watch = watched()
    words = status()
    looked(watch, words, words)
    words["status"][4] = 0x20
    looked(watch, words, words)
    assert set(planner.faults) == {NAMES[4]}


def test_a_condition_that_has_to_last_counts_when_it_has():
    planner, watch = watched("cia402")
    limited = {"statusword": [0x27 | (i == 1) * 0x800 for i in range(N)]}
    news = looked(watch, *[limited] * 25)
    assert [k for k, one in enumerate(news) if one] == [19]  # 0.2 s
    assert planner.faults == {NAMES[1]: ftqp.Degraded(NAMES[1], velocity=0.3, torque=0.3)}


def test_a_weak_joint_takes_the_place_of_no_lock():
    planner, watch = watched("cia402")
    planner.report(ftqp.Locked(NAMES[1]))
    looked(watch, *[{"statusword": [0x27 | (i == 1) * 0x800 for i in range(N)]}] * 25)
    assert planner.faults == {NAMES[1]: ftqp.Locked(NAMES[1])} and watch.standing


def test_a_joint_without_power_is_free_until_it_stands_and_locked_while_it_does():
    planner, watch = watched("dynamixel")
    q = PANDA.neutral.copy()
    looked(watch, *[error(3)] * 2, q=q)
    assert isinstance(planner.faults[NAMES[3]], ftqp.FreeSwinging)
    looked(watch, *[error(3)] * 19, q=q)
    assert isinstance(planner.faults[NAMES[3]], ftqp.FreeSwinging)
    looked(watch, *[error(3)] * 2, q=q)
    assert isinstance(planner.faults[NAMES[3]], ftqp.Locked)
    q[3] += 0.01
    looked(watch, error(3), q=q)
    assert isinstance(planner.faults[NAMES[3]], ftqp.FreeSwinging)
    looked(watch, *[error(3)] * 21, q=q)
    assert isinstance(planner.faults[NAMES[3]], ftqp.Locked)
    watch.withdraw(NAMES[3])
    assert not planner.faults


def test_without_masses_a_joint_without_power_is_locked_at_every_new_place():
    robot = ftqp.robots.load("srs7")
    planner, watch = watched("dynamixel", robot)
    q = robot.neutral.copy()
    for _ in range(3):
        for _ in range(25):
            watch.look(error(3), q)
            assert all(isinstance(one, ftqp.Locked) for one in planner.faults.values())
        q[3] += 0.1
    assert set(planner.faults) == {robot.joints[3]}


def test_a_lost_sensor_is_no_number_and_no_fault_is_invented():
    """Behind servos the planner holds the joint itself, and the others keep the position."""
    planner = started(PANDA, dt=0.002, task=ftqp.Task("position"))
    watch = ftqp.vendors.Watch(planner, "cia402")
    arm = ServoArm(PANDA.neutral, 0.002, wn=63.0)
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.05, duration=3.0)
    targets = targets_along(path, 1501, 0.002)
    for k in range(2000):
        words = {"statusword": [0x27] * N, "error_code": [0x7300 * (k > 700 and i == 3) for i in range(N)]}
        q = arm.measured()
        told = watch.look(words, q)
        assert (told is q) == (k <= 701)
        if k > 701:
            assert np.isnan(told[3]) and np.isfinite(np.delete(told, 3)).all() and np.isfinite(q).all()
        if k == 702:
            assert not planner.faults
        arm.command(planner.step(told, None, targets.at(min(k, 1500))))
    assert planner.stopped_because is None and planner.findings[0].kinds == {"sensor_dropped"}
    assert np.linalg.norm(PANDA.pose(arm.q)[:3, 3] - path.sample(3.0).pose[0, :3, 3]) < 1e-3


def test_a_pause_stops_the_planner_once_and_names_no_joint():
    robot = ftqp.robots.load("puma560")
    planner, watch = watched("universal_robots", robot)
    well = {"safety_status_bits": 1, "robot_mode": 7, "joint_mode": [253] * 6}
    stop = {**well, "safety_status_bits": 0x404}
    target = ftqp.Target(position=robot.pose(robot.neutral)[:3, 3])
    for words in (well, stop, stop):
        step = planner.step(watch.look(words, robot.neutral), None, target)
    assert watch.arm == "paused" and not planner.faults
    assert step.status in (ftqp.StepStatus.STOPPING, ftqp.StepStatus.STOPPED)
    assert planner.resume()  # the user's own: it is not stopped a second time
    for _ in range(50):
        step = planner.step(watch.look(stop, robot.neutral), None, target)
    assert step.status not in (ftqp.StepStatus.STOPPING, ftqp.StepStatus.STOPPED)


def test_a_joint_fault_of_an_arm_sold_whole_names_the_joint_and_is_off():
    planner, watch = watched("universal_robots", ftqp.robots.load("puma560"))
    modes = [252 if i == 4 else 239 for i in range(6)]
    failed = {"safety_status_bits": 0x601, "robot_mode": 3, "joint_mode": modes}
    looked(watch, failed, failed, q=np.zeros(6))
    assert watch.arm == "off"
    assert planner.faults == {planner.robot.joints[4]: ftqp.Locked(planner.robot.joints[4])}


def test_a_stream_that_is_silent_for_five_periods_pauses():
    planner, watch = watched(period=0.02)
    looked(watch, status())
    news = looked(watch, *[None] * 30)
    assert [k for k, one in enumerate(news) if one] == [9] and news[9] == ["no news for 100 ms"]
    assert watch.arm == "paused" and not planner.faults
    looked(watch, status())
    assert watch.arm == "paused"  # until begin_again
    watch.begin()
    assert watch.arm == "goes_on"


def test_a_port_that_vanishes_is_off_once():
    _, watch = watched()
    watch.look(status(), PANDA.neutral)
    for _ in range(3):
        watch.gone("/dev/ttyACM0 is gone")
    assert watch.arm == "off" and [one.why for one in watch.standing] == ["/dev/ttyACM0 is gone"]


def test_words_in_another_order_name_the_right_joints():
    planner, watch = watched(joints=NAMES[::-1])
    looked(watch, status(0), status(0))
    assert set(planner.faults) == {NAMES[-1]}


def test_what_does_not_fit_the_robot_is_refused():
    planner, watch = watched()
    for table, given, sentence in (
        ("universal_robots", {}, "7 joints are watched, expected 6, as Universal Robots has"),
        ("feetech", {"joints": ["elbow"]}, r"'elbow' is not a joint of panda.*it has panda_joint1"),
        ("cia402", {"brakes": {"elbow": True}}, "'elbow' is not a joint of panda"),
        ("cia402", {"joints": [*NAMES[:2], NAMES[0]]}, "panda_joint1 is named twice in joints"),
        ("cia402", {"brakes": True}, "brakes is .*, expected a mapping"),
        ("cia402", {"brakes": ["panda_joint1"]}, "brakes is .*, expected a mapping"),
        ("cia402", {"brakes": {"panda_joint1": "no"}}, "a brake is 'no', expected True or False"),
        ("cia402", {"joints": "panda_joint1"}, "joints is 'panda_joint1', expected their names"),
        ([], {}, "table is of type list, expected one of"),
    ):
        with pytest.raises(ftqp.InputError, match=sentence):
            ftqp.vendors.Watch(planner, table, **given)
    with pytest.raises(ftqp.InputError, match="status has 6 numbers, expected 7"):
        watch.look({"status": [0] * 6}, PANDA.neutral)
    with pytest.raises(ftqp.InputError, match=re.escape("no fault of the arm is there; watch.standing")):
        watch.recover()


@pytest.mark.parametrize("planner", [None, PANDA, "panda", ftqp.Planner])
def test_what_is_no_planner_is_refused_in_a_sentence(planner):
    for made in (
        lambda: ftqp.vendors.Watch(planner, "feetech"),
        lambda: ftqp.vendors.Spare(planner, "panda_joint1", warm=40.0, hot=60.0),
        lambda: ftqp.vendors.begin_again(planner, list, print, bool),
    ):
        with pytest.raises(ftqp.InputError, match=r"planner is .*, expected an ftqp\.Planner"):
            made()


def test_a_brake_may_be_of_a_joint_by_its_number():
    planner, watch = watched("cia402", brakes={0: True}, joints=[0])
    fault = {"statusword": [0x08], "error_code": [0x2310]}
    looked(watch, fault, fault)
    assert planner.faults == {NAMES[0]: ftqp.Locked(NAMES[0])}


def test_no_step_of_a_program_passes_over_one_of_a_person():
    _, watch = watched("universal_robots", ftqp.robots.load("puma560"))
    stop = {"safety_status_bits": 4, "robot_mode": 7, "joint_mode": [253] * 6}
    looked(watch, stop, stop, q=np.zeros(6))
    recovery = watch.recover()
    assert recovery.next.do == "planner.stop()"
    recovery.done("program")
    with pytest.raises(ftqp.InputError, match="is a step of a person, not of a program"):
        recovery.done("program")
    recovery.done("person")
    assert recovery.next.after == 5.0  # UR unlocks no sooner
    for _ in range(3):
        recovery.done("program")
    assert recovery.next is None
    with pytest.raises(ftqp.InputError, match="no step is left"):
        recovery.done("program")


def test_a_servo_is_rebooted_three_times_in_five_minutes_and_for_an_overload_only():
    _, watch = watched("dynamixel")
    first = []
    for _ in range(4):
        looked(watch, error(2), error(2))
        first.append(watch.recover(NAMES[2]).next.by)
        watch.withdraw(NAMES[2])
    assert first == ["program", "program", "program", "person"]
    looked(watch, *[error()] * 30_100)
    looked(watch, error(2), error(2))
    assert watch.recover(NAMES[2]).next.do == "reboot"
    looked(watch, error(2, 0x24), error(2, 0x24))  # hot, too
    assert watch.recover(NAMES[2]).next.by == "person"


def circled(event):
    """What comes of six servos on a circle at 30 Hz, where something befalls the fifth at 2 s."""
    robot, dt = ftqp.robots.load("puma560"), 1.0 / 30.0
    table = ftqp.vendors.table("feetech")
    q0 = np.array([0.2, -0.6, 0.4, 0.3, 0.8, 0.1])
    planner = started(robot, at=q0, dt=dt, level="velocity", task=ftqp.Task("position"), emergency=None)
    watch, servos = ftqp.vendors.Watch(planner, table), FakeServos(table, q0)
    s = ftqp.paths.Circle(robot.pose(q0), 0.06, duration=8.0).sample(dt * np.arange(300).clip(0, 240))
    targets, off = ftqp.Targets(s.pose, s.twist), []
    for k in range(300):
        if k == 60:
            event(servos.servos[4])
        words, q = servos.read()
        step = planner.step(watch.look(words, q), None, targets.at(k))
        servos.write(step.q, dt)
        off.append(np.linalg.norm(robot.pose(servos.read()[1])[:3, 3] - s.pose[min(k + 1, 299), :3, 3]))
    return planner, watch, max(off[120:])


def jammed(servo):
    servo.jammed = True


def overloaded(servo):
    servo.jammed = True
    servo.put("status", 0x20)


@pytest.mark.parametrize(("event", "reported"), [(jammed, 0), (overloaded, 1)])
def test_one_of_six_servos_that_jams_leaves_the_position_task_to_the_others(event, reported):
    """The planner sees the jam before the servo gives up; an overload is told by its word."""
    planner, watch, off = circled(event)
    joint = planner.robot.joints[4]
    assert set(planner.faults) == {joint} and watch.arm == "goes_on"
    assert [one.joint for one in watch.standing] == [joint] * reported
    healthy = circled(lambda servo: None)
    assert not healthy[0].faults and not healthy[1].standing
    assert off < healthy[2] + 1e-3 < 3e-3


@pytest.mark.parametrize("word", [0x20, 0x08])  # a joint that is off, and one whose sensor is lost
@pytest.mark.parametrize("q", [PANDA.neutral[:3], None, "home"])
def test_what_is_no_configuration_is_refused_where_it_is_looked_at(word, q):
    _, watch = watched("dynamixel")
    looked(watch, *[{"hardware_error": [0, 0, 0, word, 0, 0, 0]}] * 3)
    with pytest.raises(ftqp.InputError, match=r"^q "):
        watch.look(None, q)


def test_a_tick_without_news_makes_no_array():
    planner, watch = watched("kinova")
    words = {"arm_state": 6, "fault_bank_a": [0] * 7, "warning_bank_a": [0] * 7}
    looked(watch, *[words] * 5)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for _ in range(200):
        watch.look(words, PANDA.neutral)
    grown = tracemalloc.get_traced_memory()[0] - before
    peak = tracemalloc.get_traced_memory()[1] - before
    tracemalloc.stop()
    assert grown < 1000 and peak < 3000 and not planner.faults
