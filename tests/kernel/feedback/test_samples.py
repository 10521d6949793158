"""Which samples are believed, what those cost that are not, and numbers that repeat."""

import numpy as np
import pytest
from tests.going import started

import ftqp
from ftqp.kernel.layout.thresholds import COARSEST

ROBOT = ftqp.robots.load("planar", count=3)
LIMITS = ROBOT.limits
SIGMA = 1e-3


class Arm:
    """A planner and an arm that does what it is told, but for what is done to its samples."""

    def __init__(self, dt=0.01, sigma=0.0, speed=0.0, **settings):
        noise = ftqp.Noise(q=sigma) if sigma else None
        self.planner = ftqp.Planner(ROBOT, dt, drive="position", noise=noise, **settings)
        self.target = ftqp.Target(pose=ROBOT.pose(ROBOT.neutral))
        self.dt, self.speed = dt, speed
        self.reset()

    def reset(self):
        self.planner.reset(ROBOT.neutral)
        self.q, self.v = ROBOT.neutral.copy(), np.zeros(3)

    @property
    def loop(self):
        return self.planner.session().K.feedback

    def tick(self, sample=None, **given):
        """One step with these samples; the arm's own where there are none."""
        self.target.position[1] += self.dt * self.speed
        step = self.planner.step(self.q if sample is None else sample, None, self.target, **given)
        self.q, self.v = step.q.copy(), step.reference.v.copy()
        return step

    def off(self, joint, by):
        """Samples of which one is off."""
        return np.where(np.arange(3) == joint, self.q + by, self.q)


def room(arm, joint, age, speed=0.0):
    """How far a sample may be from what is expected, so many ticks after the last good one."""
    t, sigma = age * arm.dt, arm.loop.sigma
    top = max(LIMITS.v_max[joint], abs(speed))
    step = COARSEST if t > 0.5 * arm.loop.patience else 0.0
    return 1.3 * top * arm.dt + LIMITS.a_max[joint] * t * t + 8.5 * sigma + 1e-4 + step


@pytest.mark.parametrize("sigma", [0.0, SIGMA])
@pytest.mark.parametrize("lost", [0, 1, 2])
@pytest.mark.parametrize(("joint", "side"), [(0, 1.0), (2, -1.0)])
def test_a_sample_is_believed_up_to_what_speed_acceleration_and_noise_allow(joint, side, lost, sigma):
    for share, believed in ((0.999, True), (1.001, False)):
        arm = Arm(dt=0.004, sigma=sigma)
        arm.tick()
        for _ in range(lost):
            arm.tick(arm.off(joint, np.nan))
            assert arm.loop.bad[joint] == 1 and arm.loop.refused == 1
        expected = arm.q[joint]
        sample = arm.off(joint, side * share * room(arm, joint, lost + 1))
        arm.tick(sample)
        assert arm.loop.bad[joint] == (not believed)
        assert arm.loop.refused == (not believed)
        assert arm.loop.seen[joint] == (sample[joint] if believed else pytest.approx(expected, abs=1e-12))
        others = np.arange(3) != joint
        assert np.array_equal(np.asarray(arm.loop.seen[:3])[others], sample[others])


def test_a_joint_whose_speed_limit_is_lowered_is_still_believed_at_the_speed_that_it_has():
    arm = Arm(speed=0.4, emergency=None)
    for _ in range(8):
        arm.tick()
    joint = int(np.argmax(np.abs(arm.v)))
    arm.planner.report(ftqp.Degraded(joint, velocity=0.001))
    assert 1.3 * 0.001 * arm.dt + 5.0 * arm.dt**2 + 1e-4 < 1.2 * arm.dt * abs(arm.v[joint])
    arm.tick(arm.off(joint, 1.2 * arm.dt * arm.v[joint]))
    assert arm.loop.bad[joint] == 0


@pytest.mark.parametrize("went", [True, False])
def test_a_joint_may_have_gone_on_or_stood_while_nothing_was_heard(went):
    """Friction had held it: it was refused, and its sensor counted as lost."""
    arm = Arm(dt=0.002, speed=0.6, emergency=None)
    for _ in range(300):
        arm.tick(arm.q + 1e-5 * np.sin(1e3 * arm.q))
    joint, stood = int(np.argmax(np.abs(arm.v))), arm.q.copy()
    for _ in range(30):
        arm.tick(np.full(3, np.nan))
    assert abs(arm.q[joint] - stood[joint]) > 0.04
    arm.tick(arm.q if went else np.where(np.arange(3) == joint, stood, arm.q))
    assert list(arm.loop.bad[:3]) == [0, 0, 0]


@pytest.mark.parametrize("bad", [11, 10])
def test_patience_ends_after_twenty_milliseconds_of_bad_samples(bad):
    arm = Arm(dt=0.002)
    arm.tick()
    for k in range(bad):
        assert not arm.planner.findings, k
        arm.tick(arm.off(1, np.nan))
    assert [one.joint for one in arm.planner.findings] == [ROBOT.joints[1]] * (bad == 11)
    assert arm.planner.stopped_because is None, "its servo holds it, and the others go on"
    if bad == 11:
        assert list(arm.loop.lost[:3]) == [0, 1, 0]
        arm.tick()
        assert arm.loop.bad[1] == 1, "a lost sensor is believed no more, whatever it says"
        arm.reset()
        arm.tick()
        assert arm.loop.bad[1] == 0 and arm.planner.stopped_because is None


@pytest.mark.parametrize("what", ["v", "tip"])
def test_what_else_is_not_finite_costs_patience_too(what):
    arm = Arm(dt=0.002)
    tip = ROBOT.pose(ROBOT.neutral)
    arm.tick()
    for k in range(11):
        assert arm.planner.stopped_because is None
        if what == "tip":
            broken = tip.copy()
            broken[(0, 2, 1)[k % 3], (0, 3, 2)[k % 3]] = np.nan
            step = arm.tick(tip=broken)
        else:
            step = arm.planner.step(arm.q, np.array([0.0, np.inf, 0.0]), arm.target)
        assert arm.loop.refused == 1
        assert step.status is ftqp.StepStatus.INVALID_INPUT or arm.planner.stopped_because is not None
    assert "v, tau or the end effector" in arm.planner.stopped_because


@pytest.mark.parametrize("drive", ["position", "velocity"])
def test_after_a_reset_nothing_is_left_of_what_came_before(drive):
    def driven(planner, rng):
        planner.reset(ROBOT.neutral)
        target, q, told = ftqp.Target(pose=ROBOT.pose(ROBOT.neutral)), ROBOT.neutral.copy(), []
        for _ in range(12):
            target.position[1] += 0.002
            step = planner.step(q + 1e-3 * rng.standard_normal(3), None, target)
            q = step.q.copy() if drive == "position" else q + 0.01 * step.v
            told.append(np.concatenate([step.q, step.v, step.a, [step.code], step.brakes]))
        return np.array(told)

    def made():
        return ftqp.Planner(ROBOT, 0.01, drive=drive, noise=ftqp.Noise(q=SIGMA))

    fresh, used = made(), made()
    expected = driven(fresh, np.random.default_rng(1))
    driven(used, np.random.default_rng(2))
    here, away = ftqp.Target(pose=ROBOT.pose(ROBOT.neutral)), np.array([0.0, 0.3, np.nan])
    for _ in range(9):
        used.step(ROBOT.neutral + away, np.array([np.nan, 0.0, 0.0]), here, tip=np.full((4, 4), np.nan))
    assert used.stopped_because is not None
    assert np.array_equal(driven(used, np.random.default_rng(1)), expected)


def stopped(dt, sigma=0.0, **settings):
    """A planner whose arm was stopped at rest."""
    noise = ftqp.Noise(q=sigma) if sigma else None
    planner = started(ROBOT, dt, drive="torque", noise=noise, **settings)
    target = ftqp.Target(pose=ROBOT.pose(ROBOT.neutral))
    planner.step(ROBOT.neutral, None, target)
    planner.stop()
    return planner, target


@pytest.mark.parametrize("sigma", [0.0, 1e-3])
@pytest.mark.parametrize(("joint", "side"), [(0, 1.0), (2, -1.0)])
def test_in_a_stop_a_joint_that_leaves_its_error_band_for_twenty_milliseconds_asks_for_its_brake(
    joint, side, sigma
):
    dt = 0.004
    band = 0.02 + 6.0 * sigma
    planner, target = stopped(dt, sigma)
    beside, ticks, asked = 0.0, 0, None
    q = ROBOT.neutral.copy()
    for k in range(60):
        beside = min(beside + 0.6 * dt, 1.04 * band)
        q[joint] = ROBOT.neutral[joint] + side * beside + (1e-9 if k % 2 else 0.0)
        step = planner.step(q, None, target)
        ticks += beside > band
        if step.brakes.any() and asked is None:
            asked = ticks
            assert step.brakes.tolist() == (np.arange(3) == joint).tolist()
    assert asked == 5


@pytest.mark.parametrize("joint", [0, 2])
def test_within_its_error_band_a_joint_asks_for_no_brake_nor_outside_while_nothing_is_stopped(joint):
    dt = 0.004
    for stop, most in ((True, 0.96 * 0.02), (False, 0.06)):
        planner, target = stopped(dt, emergency=None)
        if not stop:
            planner.reset(ROBOT.neutral)
            target = ftqp.Target(pose=ROBOT.pose(ROBOT.neutral))
        q = ROBOT.neutral.copy()
        for k in range(40):
            q[joint] = ROBOT.neutral[joint] + min(0.6 * dt * k, most)
            step = planner.step(q, None, target)
            assert not step.brakes.any()


def test_a_joint_that_is_known_to_have_failed_asks_for_nothing():
    planner = started(ROBOT, 0.01, drive="position", task=ftqp.Task(rows=("x",)), emergency=None)
    planner.report(ftqp.Locked(2))
    target = ftqp.Target(position=ROBOT.pose(ROBOT.neutral)[:3, 3])
    q = ROBOT.neutral.copy()
    for _ in range(25):
        q[2] -= 1.28 * LIMITS.v_max[2] * 0.01
        assert not planner.step(q, None, target).brakes.any()


def test_a_joint_out_of_hand_is_seen_behind_one_that_has_failed():
    planner = started(ROBOT, 0.01, drive="position", task=ftqp.Task(rows=("x",)), emergency=None)
    planner.report(ftqp.Locked(0))
    target, q = ftqp.Target(position=ROBOT.pose(ROBOT.neutral)[:3, 3]), ROBOT.neutral.copy()
    for _ in range(16):
        q[2] -= 1.28 * LIMITS.v_max[2] * 0.01
        step = planner.step(q, None, target)
    assert step.brakes.tolist() == [False, False, True]


DT = 1e-3
PLANAR = ftqp.robots.load("planar", count=3)


class Standing:
    """An arm that follows exactly, but for the joint whose number stays the same from tick 80 on."""

    def __init__(self, drive):
        self.planner = ftqp.Planner(PLANAR, DT, drive=drive, task=ftqp.Task(("x", "y")))
        self.planner.reset(PLANAR.neutral)
        self.target = ftqp.Target(pose=PLANAR.pose(PLANAR.neutral))
        self.q, self.k, self.stuck = PLANAR.neutral.copy(), 0, None
        self.joint = None

    def ticks(self, count):
        said = []
        for _ in range(count):
            self.target.position[1] += DT * min(0.3, 2.0 * DT * self.k)
            step = self.planner.step(self.q, None, self.target)
            self.q = step.reference.q.copy()
            if self.k >= 180:
                if self.joint is None:
                    self.joint = int(np.argmax(np.abs(step.reference.v)))
                    self.stuck = self.q[self.joint]
                self.q[self.joint] = self.stuck
            self.k += 1
            said.append((step.status.name, self.planner.stopped_because))
        return said


def test_brake_that_was_not_told_is_a_following_error_of_a_position_drive():
    said = Standing("position").ticks(900)
    assert "INVALID_INPUT" not in {status for status, _ in said}
    assert "LAGGING" in {status for status, _ in said}
    assert "sensor" not in str(said[-1][1]) and "encoder" not in str(said[-1][1])


def test_velocity_drive_gives_no_feedback_to_a_joint_whose_number_repeats():
    arm = Standing("velocity")
    arm.ticks(180)
    for _ in range(30):
        arm.ticks(1)
    step = arm.planner.step(arm.q, None, arm.target)
    assert abs(step.v[arm.joint] - step.reference.v[arm.joint]) < 1e-9
    assert arm.planner.stopped_because is None


@pytest.mark.parametrize("told", [True, False])
def test_torque_drive_stops_for_a_number_that_repeats_and_goes_on_once_it_is_told_of_a_lock(told):
    arm = Standing("torque")
    said = arm.ticks(330)
    why = said[-1][1]
    assert "INVALID_INPUT" in {status for status, _ in said}
    assert "it is frozen, or the joint stands" in why and PLANAR.joints[arm.joint] in why
    if told:
        arm.planner.report(ftqp.Locked(arm.joint))
        arm.ticks(2)
    assert arm.planner.resume() is told


@pytest.mark.long
@pytest.mark.parametrize(("name", "joint"), [("panda", 1), ("panda", 3), ("iiwa14", 1), ("xarm7", 1)])
def test_torque_joint_whose_encoder_freezes_stays_below_its_speed_limit_without_stated_noise(name, joint):
    """At 0.45 rad/s; it went at four to twelve times its limit."""
    pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    robot = ftqp.robots.load(name)
    planner = ftqp.Planner(robot, DT, drive="torque")
    plant = ftqp.MujocoPlant(robot, DT, ftqp.JointServo(robot, "torque"))
    planner.reset(robot.neutral)
    q_r, peak, stuck = robot.neutral.copy(), 0.0, None
    for k in range(1800):
        v_r = np.zeros(robot.nv)
        v_r[joint] = 0.45 * min(1.0, k / 300.0)
        q_r = q_r + DT * v_r
        target = ftqp.Target(pose=robot.pose(q_r), twist=robot.jacobian(q_r) @ v_r)
        sample = plant.q.copy()
        if k >= 1000:
            stuck = sample[joint] if stuck is None else stuck
            sample[joint] = stuck
            peak = max(peak, float(np.max(np.abs(plant.v) / robot.limits.v_max)))
        step = planner.step(sample, None, target)
        plant.advance(step)
    assert peak < 0.8
    assert step.status is ftqp.StepStatus.STOPPED and step.brakes[joint]
    assert robot.joints[joint] in planner.stopped_because


@pytest.mark.long
@pytest.mark.parametrize("name", ["panda", "iiwa14"])
@pytest.mark.parametrize("quantum", [1e-5, 5e-4])
def test_torque_joints_that_stick_behind_quantised_encoders_are_no_broken_sensors(name, quantum):
    """0.5 N m of dry friction that nobody told, on wrists without rotors: they stick for 0.1 s."""
    pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    robot = ftqp.robots.load(name)
    planner = ftqp.Planner(robot, DT, drive="torque", emergency=None)
    plant = ftqp.MujocoPlant(robot, DT, ftqp.JointServo(robot, "torque"), ftqp.TrueArm(coulomb=0.5))
    planner.reset(robot.neutral)
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.05, duration=1.5, axes=("y", "z"))
    led = path.sample(np.minimum(DT * np.arange(1700), path.duration))
    for pose, twist, acceleration in zip(led.pose, led.twist, led.acceleration, strict=True):
        target = ftqp.Target(pose=pose, twist=twist, acceleration=acceleration)
        step = planner.step(quantum * np.round(plant.q / quantum), None, target)
        assert step.status is not ftqp.StepStatus.INVALID_INPUT
        plant.advance(step)
    assert planner.stopped_because is None
