"""STOPPED is said of the arm, impacts are no broken sensors, and brakes are asked for as the arm has them."""

import numpy as np
import pytest
from tests.going import closed_loop
from tests.ride import DT, START, circle, target_at

import ftqp

OVERLOADED = 1
"""The joint of a Panda that carries most."""


@pytest.fixture(scope="module")
def robot():
    return ftqp.robots.load("panda")


class Arm:
    """A planner and an arm that does as its reference does, but for what is done to its samples."""

    def __init__(self, robot, drive="position", start=START, **settings):
        self.planner = ftqp.Planner(robot, DT, drive=drive, task=ftqp.Task(rows="position"), **settings)
        self.planner.reset(start)
        self.target = ftqp.Target(pose=robot.pose(start))
        self.q = np.array(start)

    def tick(self, beside=0.0):
        self.step = self.planner.step(self.q + beside, None, self.target)
        self.q = self.step.reference.q.copy()
        return self.step


def test_arm_whose_joint_is_seen_to_move_has_not_stopped(robot, drive):
    arm = Arm(robot, drive, emergency=None)
    arm.tick()
    arm.planner.stop()
    for _ in range(30):
        arm.tick()
    assert arm.step.status is ftqp.StepStatus.STOPPED
    said, beside, turning = [], np.zeros(7), 0.1 * robot.limits.v_max[3] * DT
    for k in range(400):
        if k < 100:
            beside[3] += turning * (1.0 if k < 50 else -1.0)
        elif k == 300:
            assert arm.planner.stopped_because == "stop() was called"
        arm.tick(beside)
        said.append(arm.step.status.name)
        if said[-1] == "STOPPING":
            assert arm.planner.stopped_because == "stop() was called; panda_joint4 is not seen to rest"
    assert "STOPPING" in said[:50] and set(said[200:]) == {"STOPPED"}


def test_creeping_and_noise_do_not_take_back_that_the_arm_has_stopped(robot):
    arm = Arm(robot, noise=ftqp.Noise(q=1e-4))
    rng = np.random.default_rng(0)
    arm.tick()
    arm.planner.stop()
    said = []
    for k in range(600):
        drift = 0.02 * robot.limits.v_max * DT * k
        said.append(arm.tick(1e-4 * rng.standard_normal(7) + drift).status.name)
    assert set(said[100:]) == {"STOPPED"}


@pytest.mark.parametrize(("at_the_end", "believed"), [(True, True), (False, False)])
def test_samples_faster_than_limits_are_believed_only_after_an_impact_at_an_end_stop(
    robot, at_the_end, believed
):
    start = START.copy()
    if at_the_end:
        start[0] = robot.limits.q_max[0] - 0.02
    arm = Arm(robot, start=start, emergency=None)
    beside = np.zeros(7)
    for _ in range(20):
        beside[0] += 0.001  # 1 rad/s, towards the end of the range
        arm.tick(beside)
    beside[4] += 1.5 * 1.3 * robot.limits.v_max[4] * DT + 1e-3
    arm.tick(beside)
    assert (arm.step.status is not ftqp.StepStatus.INVALID_INPUT) is believed
    for k in range(120):  # it is over after 100 ms
        beside[0] -= 1e-4 * (k < 100)
        arm.tick(beside)
    beside[4] += 1.5 * 1.3 * robot.limits.v_max[4] * DT + 1e-3
    assert arm.tick(beside).status is ftqp.StepStatus.INVALID_INPUT


@pytest.mark.parametrize("drive", ["position", "torque"])
@pytest.mark.parametrize(("left", "holds"), [(0.9, True), (0.02, False)])
def test_degraded_joint_that_cannot_hold_the_arm_asks_for_its_brake_at_the_report(robot, drive, left, holds):
    arm = Arm(robot, drive)
    for _ in range(5):
        arm.tick()
    arm.planner.report(ftqp.Degraded(OVERLOADED, torque=left))
    step = arm.tick()
    assert step.brakes.tolist() == [not holds and i == OVERLOADED for i in range(7)]
    assert (arm.planner.stopped_because is None) is holds
    if not holds:
        assert arm.planner.stopped_because.startswith("panda_joint2 cannot hold the arm here")


@pytest.mark.parametrize("brakes", ["each", "all", "none"])
def test_brakes_are_asked_for_as_the_arm_has_them(robot, drive, brakes):
    arm = Arm(robot, ftqp.Drive(kind=drive, brakes=brakes), emergency=None)
    beside, place = np.zeros(7), START
    for _ in range(20):
        arm.tick()
    for _ in range(250):
        if arm.step.brakes.any():  # they close
            beside += place - arm.q - beside
        else:
            beside[6] += 1.28 * robot.limits.v_max[6] * DT
            place = arm.q + beside
        step = arm.tick(beside)
    expected = {"each": [False] * 6 + [True], "all": [True] * 7, "none": [False] * 7}
    assert step.brakes.tolist() == expected[brakes]
    assert (arm.planner.stopped_because is None) is (brakes != "all")
    if brakes == "all":
        assert arm.planner.resume() is False, "all joints are braked"
        arm.planner.reset(START)
        arm.q = START
        assert not arm.tick().brakes.any()


def test_lost_sensor_of_a_torque_arm_asks_for_all_brakes_where_they_close_together(robot):
    for brakes, count in (("each", 1), ("all", 7), ("none", 0)):
        arm = Arm(robot, ftqp.Drive(kind="torque", brakes=brakes))
        for _ in range(40):
            step = arm.tick(np.where(np.arange(7) == 2, np.nan, 0.0))
        assert step.brakes.sum() == count and arm.planner.stopped_because is not None


def test_joint_that_runs_against_its_command_is_still_seen(robot):
    """It moved one way at 80 % of its limit while its command went the other way at 60 %."""
    arm = Arm(robot, "torque", emergency=None)
    top, along = robot.limits.v_max[3], 0.0
    arm.planner.reset(START, np.where(np.arange(7) == 3, 0.6 * top, 0.0))
    here = START[3]
    for k in range(60):
        arm.q[3] = here
        step = arm.tick()
        along = max(along, float(step.reference.v[3]))
        here -= min(0.8 * top, k * 0.03 * top) * DT
        assert step.status is not ftqp.StepStatus.INVALID_INPUT, k
    assert along > 0.3 * top


JOINT = 6
"""The last joint turns about the tool axis: a task of positions does not see it."""


def runaway(robot, drive, share, emergency, rested=250):
    """Ticks until the last joint, which moves at ``share`` of its speed limit unasked, asks for its brake.

    It begins after so many ticks; in the first 0.2 s the noise of a torque arm's samples is not known yet.

    None when it has moved for 0.3 s without that; and the last step.
    """
    planner = ftqp.Planner(robot, DT, drive=drive, task=ftqp.Task(rows="position"), **emergency)
    planner.reset(START)
    here = ftqp.Target(pose=robot.pose(START))
    q = START.copy()
    for _ in range(rested):
        planner.step(q, None, here)
    for k in range(300):
        q[JOINT] += share * robot.limits.v_max[JOINT] * DT
        step = planner.step(q, None, here)
        if step.brakes.any():
            return k, step
    return None, step


def test_joint_far_faster_than_asked_and_allowed_is_braked_and_stops_the_arm(robot, drive):
    ticks, step = runaway(robot, drive, 1.28, {})
    assert ticks is not None and step.status.name in ("STOPPING", "STOPPED")
    assert step.brakes.tolist() == (np.arange(7) == JOINT).tolist()


def test_servo_is_given_longer_than_a_torque_arm(robot):
    """A servo that was pushed comes back by itself; a torque arm that runs away does not."""
    fast = {drive: runaway(robot, drive, 1.28, {"emergency": None})[0] for drive in ("velocity", "torque")}
    assert fast["velocity"] * DT >= 0.1
    assert fast["torque"] * DT <= 0.06  # of which the observer needs all but 10 ms
    assert runaway(robot, "torque", 1.28, {"emergency": None}, rested=20)[0] * DT <= 0.1


def fastest(robot, beside, *faults):
    """Largest share of a speed limit asked for on a circle that is too fast, with samples ``beside`` off."""
    planner = ftqp.Planner(robot, DT, drive="position", emergency=None)
    planner.reset(START)
    for fault in faults:
        planner.report(fault)
    path, q, most = circle(robot, START, 0.15, 0.8), START, 0.0
    for k in range(700):
        step = planner.step(q, None, target_at(path, k * DT))
        q = step.reference.q + beside * (k % 2)
        healthy = [name not in planner.faults for name in robot.joints]
        most = max(most, float((np.abs(step.reference.v) / robot.limits.v_max)[healthy].max()))
    return most


@pytest.mark.parametrize(("beside", "faults", "least", "most"), [
    (0.0, (), 1.0 - 1e-6, 1.0 + 1e-6),
    (1e-5, (), 0.955, 0.961),
    (1e-5, (ftqp.FreeSwinging(0, damping=3.0),), 0.875, 0.881),
])  # fmt: skip
def test_arm_with_servos_keeps_some_of_its_speed_for_them_and_more_beside_a_joint_that_swings(
    robot, beside, faults, least, most
):
    """Nothing where it follows to the last bit, four per cent where its servo is known to follow that fast.

    The first joint of a standing arm, which swings, knows no gravity: the others go on with the task.
    """
    assert least < fastest(robot, beside, *faults) < most


TWO_MS = 2e-3
STOPPING, STOPPED = ftqp.StepStatus.STOPPING, ftqp.StepStatus.STOPPED


def running_away(home, speed=1.0, start=0.2):
    """A target that leaves the arm behind: the error rises on every tick."""
    target = ftqp.Target(pose=home)

    def at(k):
        target.position[:] = home[:3, 3] + [0.0, 0.0, start + speed * TWO_MS * k]
        return target

    return at


@pytest.mark.parametrize("samples", [1, 7])
def test_stop_comes_after_that_many_rising_samples(panda, home, level, samples):
    stop = ftqp.EmergencyStop(position=0.05, samples=samples)
    planner = ftqp.Planner(panda, TWO_MS, level=level, emergency=stop)
    statuses = [s.status for s in closed_loop(planner, running_away(home), samples + 3)]
    first = next(k for k, s in enumerate(statuses) if s in (STOPPING, STOPPED))
    assert first == samples  # sample 0 has nothing to rise from


def test_rotation_error_stops_too(panda, home, level):
    target = ftqp.Target(pose=home)
    rotation = home[:3, :3].copy()

    def turning(k):
        c, s = np.cos(0.5 + 0.01 * k), np.sin(0.5 + 0.01 * k)
        target.pose[:3, :3] = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ rotation
        return target

    *_, last = closed_loop(ftqp.Planner(panda, TWO_MS, level=level), turning, 10)
    assert last.status in (STOPPING, STOPPED)


@pytest.mark.parametrize("backend", ["active_set", "daqp"])
def test_stop_brakes_every_joint_within_its_limits_and_latches_until_reset(panda, home, level, backend):
    path = ftqp.paths.Circle(home, 0.15, duration=1.2, axes=("y", "z"))
    sample = path.sample(np.arange(600) * TWO_MS)
    target = ftqp.Target(pose=home)

    def at(k):
        target.pose[:], target.twist[:] = sample.pose[k], sample.twist[k]
        if 250 <= k < 260:
            target.position[2] += 0.3 + 0.01 * k
        return target

    planner = ftqp.Planner(panda, TWO_MS, level=level, backend=backend)
    speed, seen, moving = np.zeros(7), [], None
    limits = panda.limits
    for step in closed_loop(planner, at, 600):
        seen.append(step.status)
        if step.status in (STOPPING, STOPPED):
            moving = np.abs(speed).max() if moving is None else moving
            assert np.all(np.abs(step.a) <= limits.a_max * (1.0 + 1e-9))
            assert np.all(np.abs(step.tau) <= limits.tau_max + 1e-6)
            assert np.all(np.abs(step.v) <= np.abs(speed) + 1e-12)
            assert np.all(step.q > limits.q_min) and np.all(step.q < limits.q_max)
            assert step.scale == 0.0 and step.certificate is None
        speed = step.v.copy()
    first = seen.index(STOPPING)
    assert 250 < first < 260 and moving > 0.2
    rest = seen.index(STOPPED)
    assert set(seen[first:rest]) == {STOPPING} and set(seen[rest:]) == {STOPPED}
    assert (rest - first) * TWO_MS < 0.5
    assert np.abs(speed).max() < 1e-9
    planner.reset(panda.neutral)
    assert planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home)).status is ftqp.StepStatus.OK


def test_stopped_arm_still_takes_reports_and_bad_input(panda, home):
    planner = ftqp.Planner(panda, TWO_MS)
    *_, last = closed_loop(planner, running_away(home), 100)
    assert last.status is STOPPED
    planner.report(ftqp.Locked(1))
    step = planner.step(np.full(7, np.nan), np.zeros(7), ftqp.Target(pose=home))
    assert step.status is STOPPED and np.isfinite(step.q).all()
    assert planner.step(step.q.copy(), step.v.copy(), ftqp.Target(pose=home)).status is STOPPED


def test_error_that_only_noise_lifts_does_not_stop(panda, home):
    """Three rising samples in a row, not three in all."""
    target = ftqp.Target(pose=home)

    def jumping(k):
        target.position[:] = home[:3, 3] + [0.0, 0.0, 0.2 + 0.05 * (k % 3 != 0)]
        return target

    planner = ftqp.Planner(panda, TWO_MS, emergency=ftqp.EmergencyStop(position=0.05, samples=3))
    assert not {s.status for s in closed_loop(planner, jumping, 15)} & {STOPPING, STOPPED}


def test_a_stop_that_is_asked_for_outlasts_one_that_a_free_joint_asked_for(robot):
    """The arm is stopped while it is decided what can be kept beside free joints, and goes on by itself."""
    planner = ftqp.Planner(robot, DT, task=ftqp.Task(mode="hard"), drive="position")
    planner.reset(robot.neutral)
    planner.report(ftqp.FreeSwinging(1))
    planner.report(ftqp.FreeSwinging(3))
    target = ftqp.Target(pose=robot.pose(robot.neutral))
    planner.step(robot.neutral, None, target)
    assert planner.stopped_because == "a joint swings freely, and nothing of the task can be kept"
    planner.stop()
    for _ in range(50):  # the samples show that neither joint swings
        assert planner.step(robot.neutral, None, target).status in (STOPPING, STOPPED)
