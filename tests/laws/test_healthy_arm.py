"""Laws of the monitor: a healthy arm goes on of which nothing was told, and untold failures are found.

The arms' servos are of second order and share nothing with what the planner supposes of them.
"""

import logging

import numpy as np
import pytest
from tests.going import started, targets_along
from tests.laws.test_held_arm import stranger
from tests.servo_arm import ServoArm

import ftqp
from ftqp.control.drive.learned_servos import LearnedServos
from ftqp.model import catalog

PANDA = catalog.load("panda")
SERVOS = {"4 Hz": 25.0, "10 Hz": 63.0, "40 Hz": 250.0}
FAST, SLOW = 1e-3, 1e-2
PANDA_WEIGHT = 22.0
"""What the panda's fourth joint holds at rest in its neutral posture [N m]."""
POSITION = ftqp.Task(rows="position")
TAKES = {"position": "position only", "velocity": "velocity"}


def posture(robot):
    """Where an arm begins: the stranger bent, so that it can do without any one joint."""
    return robot.neutral if robot.name == PANDA.name else np.array([0.0, 0.6, 0.0, 1.2, 0.0, 0.8, 0.0])


class Motion:
    """An arm is led round a circle, begun gently: errors of the true tip [m], what was said, found and when.

    Args:
        event: A joint that a brake holds from ``at`` on, before ``until`` [s].
        sees: What the planner is given, of the tick and what the encoders say.
    """

    def __init__(
        self, robot, arm, dt, seconds, event=None, at=1.2, until=np.inf, *,
        sees=lambda k, q: q, radius=0.06, lasts=3.0, **planner,
    ):  # fmt: skip
        self.planner = p = started(robot, dt=dt, at=posture(robot), **planner)
        path = ftqp.paths.Circle(robot.pose(posture(robot)), radius, duration=lasts)
        targets = targets_along(path, round(seconds / dt), dt)
        places = path.sample(dt * np.arange(len(targets))).pose[:, :3, 3]
        self.error, self.said, self.found_after = [], [], None
        for k, place in enumerate(places):
            if event is not None:
                arm.braked[event] = at <= k * dt < until
            self.step = p.step(sees(k, arm.measured()), None, targets.at(k))
            arm.command(self.step)
            self.said.append(self.step.status)
            self.error.append(np.linalg.norm(robot.pose(arm.q)[:3, 3] - place))
            if self.found_after is None and p.faults:
                self.found_after = k * dt - at

    @property
    def is_calm(self):
        """Whether nobody was accused, and the arm not stopped."""
        return self.planner.stopped_because is None and not (self.planner.faults or self.planner.findings)


class IdealArm:
    """Its joints are where they are sent at once; a brake holds one there."""

    def __init__(self):
        self.q, self.braked, self.sent = PANDA.neutral.copy(), np.zeros(PANDA.nv, bool), []

    def measured(self):
        return self.q.copy()

    def command(self, step):
        self.q = np.where(self.braked, self.q, step.q)
        self.sent.append(self.q)


def arm_of(robot, dt, wn, takes="position only", sigma=2e-5):
    return ServoArm(posture(robot), dt, takes=takes, wn=wn, sigma=sigma)


@pytest.mark.long
@pytest.mark.parametrize("drive", TAKES)
@pytest.mark.parametrize("dt", [FAST, SLOW])
@pytest.mark.parametrize("servo", SERVOS)
def test_a_healthy_arm_is_neither_stopped_nor_accused(servo, dt, drive, tmp_path):
    robot = stranger(tmp_path)
    motion = Motion(robot, arm_of(robot, dt, SERVOS[servo], TAKES[drive]), dt, 3.0, drive=drive)
    assert motion.is_calm


class CoarseArm(ServoArm):
    """Encoders of 4,096 steps a turn, and friction that holds each joint 3 mrad off: all repeat at first."""

    def __init__(self, q, dt, **options):
        super().__init__(q, dt, **options)
        self.dry = np.full(len(q), 3e-3 * self.wn**2)

    def measured(self):
        return np.round(super().measured() * 4096 / (2 * np.pi)) * (2 * np.pi) / 4096


@pytest.mark.parametrize("dt", [0.002, SLOW])
@pytest.mark.parametrize("sigma", [0.0, 1e-5])
def test_numbers_of_coarse_encoders_that_all_repeat_are_no_dead_line(sigma, dt, tmp_path):
    robot = stranger(tmp_path)
    arm = CoarseArm(posture(robot), dt, takes="position only", wn=40.0, sigma=sigma)
    motion = Motion(robot, arm, dt, 4.0, drive=ftqp.Drive(takes_velocity=False))
    assert ftqp.StepStatus.INVALID_INPUT not in motion.said
    assert motion.planner.stopped_because is None and not motion.planner.faults
    assert motion.error[-1] < 5e-3


@pytest.mark.parametrize("servo", ["4 Hz", "10 Hz"])
def test_a_learned_servo_is_led_nearly_as_one_that_was_told(servo):
    wn = SERVOS[servo]
    told = Motion(
        PANDA, arm_of(PANDA, FAST, wn), FAST, 3.0, drive=ftqp.Drive(takes_velocity=False, bandwidth=wn)
    )
    found = Motion(PANDA, arm_of(PANDA, FAST, wn), FAST, 3.0, drive=ftqp.Drive(takes_velocity=False))
    late = slice(1500, None)  # the first half teaches
    assert np.mean(found.error[late]) <= 1.5 * np.mean(told.error[late]) + 1e-4


def lines_that_stutter(drive, lock=None, late=3):
    """A fast motion of which all samples now and then come some periods late together."""
    past = []

    def sees(k, q):
        past.append(q)
        return past[max(0, k - late) if int(k * SLOW / 0.15) % 4 == 3 else k]

    arm = arm_of(PANDA, SLOW, SERVOS["10 Hz"], TAKES[drive])
    way = {"radius": 0.15, "lasts": 2.0, "drive": drive, "task": POSITION}
    return Motion(PANDA, arm, SLOW, 4.0, lock, 1.0, sees=sees, **way)


@pytest.mark.parametrize("drive", TAKES)
def test_samples_that_are_late_together_accuse_no_joint(drive):
    motion = lines_that_stutter(drive)
    assert motion.is_calm
    assert "that is the clock" in motion.planner.diagnosis.sentences[0]


@pytest.mark.parametrize("drive", TAKES)
def test_a_lock_is_found_beside_samples_that_are_late_together(drive):
    motion = lines_that_stutter(drive, lock=1)
    assert [one.joint for one in motion.planner.findings] == [PANDA.joints[1]]


@pytest.mark.parametrize("drive", TAKES)
def test_an_encoder_that_has_not_changed_its_number_yet_is_no_line_that_fails(drive):
    """Steps of 1.5 mrad, and a motion that begins gently: the arm waited for other numbers for ever."""
    arm = arm_of(PANDA, FAST, 188.0, TAKES[drive], sigma=0.0)
    motion = Motion(PANDA, arm, FAST, 1.0, sees=lambda k, q: 1.5e-3 * np.round(q / 1.5e-3), drive=drive)
    assert ftqp.StepStatus.INVALID_INPUT not in motion.said


@pytest.mark.parametrize("wrong", [np.nan, 0.3])
@pytest.mark.parametrize("drive", TAKES)
def test_a_lost_sensor_of_an_ideal_arm_is_survived_as_behind_servos(drive, wrong):
    lost = np.where(np.arange(7) == 3, wrong, 0.0)
    sees = lambda k, q: q + lost if k >= 1000 else q  # noqa: E731
    motion = Motion(PANDA, IdealArm(), FAST, 2.0, sees=sees, drive=drive)
    assert motion.planner.stopped_because is None and set(motion.planner.faults) == {PANDA.joints[3]}


@pytest.mark.long
@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize("servo", ["10 Hz", "40 Hz"])
@pytest.mark.parametrize("drive", TAKES)
def test_a_lock_that_nobody_told_is_found_and_survived(drive, servo, joint, tmp_path):
    if (drive, joint) == ("velocity", 4):
        pytest.skip("it hardly moves, and friction of a velocity servo could as well hold it")
    robot = stranger(tmp_path)
    arm = arm_of(robot, FAST, SERVOS[servo], TAKES[drive])
    motion = Motion(robot, arm, FAST, 3.0, event=joint, task=POSITION, drive=drive)
    name = robot.joints[joint]
    assert set(motion.planner.faults) == {name}
    assert motion.planner.stopped_because is None
    assert motion.found_after < 1.0
    (finding,) = motion.planner.findings
    assert finding.joint == name and finding.kinds == {"locked"} and name in finding.sentence


@pytest.mark.parametrize("drive", TAKES)
def test_a_brake_that_opens_again_is_noticed(drive):
    arm = arm_of(PANDA, FAST, 63.0, TAKES[drive])
    motion = Motion(PANDA, arm, FAST, 4.0, event=3, until=2.0, drive=drive)
    assert not motion.planner.faults
    (finding,) = motion.planner.findings
    assert finding.joint == PANDA.joints[3] and finding.withdrawn_at > finding.detected_at


def test_a_velocity_arm_says_that_a_joint_which_it_found_locked_is_where_it_stands():
    arm = arm_of(PANDA, FAST, 25.0, TAKES["velocity"])
    motion = Motion(PANDA, arm, FAST, 2.0, event=3, drive="velocity")
    assert set(motion.planner.faults) == {PANDA.joints[3]}
    assert abs(motion.step.q[3] - arm.q[3]) < 5e-4


@pytest.mark.parametrize("drive", TAKES)
def test_without_a_detector_nobody_is_named(drive):
    arm = arm_of(PANDA, FAST, 63.0, TAKES[drive])
    motion = Motion(PANDA, arm, FAST, 3.0, event=3, detector=False, drive=drive)
    assert not motion.planner.faults and not motion.planner.findings


@pytest.mark.parametrize("drive", TAKES)
def test_an_ideal_arm_is_sent_what_it_would_be_without_the_monitor(drive):
    watched, plain = IdealArm(), IdealArm()
    Motion(PANDA, watched, FAST, 1.0, drive=drive)
    Motion(PANDA, plain, FAST, 1.0, detector=False)
    assert np.array_equal(watched.sent, plain.sent)


@pytest.mark.parametrize("drive", TAKES)
def test_a_lock_of_an_ideal_arm_is_found_at_once(drive):
    motion = Motion(PANDA, IdealArm(), FAST, 1.0, event=3, at=0.7, drive=drive)
    assert set(motion.planner.faults) == {PANDA.joints[3]}


@pytest.mark.parametrize("times", [0.1, 10.0])
def test_a_bandwidth_that_is_stated_wrong_stops_nobody(times):
    drive = ftqp.Drive(takes_velocity=False, bandwidth=63.0 * times)
    motion = Motion(PANDA, arm_of(PANDA, FAST, 63.0), FAST, 3.0, drive=drive)
    assert motion.planner.stopped_because is None and not motion.planner.faults


@pytest.mark.parametrize("joint", [0, 1, 3])
def test_a_lock_soon_after_the_start_of_a_fast_motion_is_found(joint):
    """Droop took it, beside a friction below zero that then excused every joint that stands."""
    dt = 2 * FAST
    p, arm = started(PANDA, dt=dt, drive=ftqp.Drive(bandwidth=94.0)), arm_of(PANDA, dt, 94.0, "position")
    goal = ftqp.GoTo(p, pose=PANDA.pose(PANDA.neutral + np.array([1.0, 0.4, 0.3, 0.5, 0.4, 0.3, 0.2])))
    for k in range(1000):
        arm.braked[joint] = k >= 100
        arm.command(goal.step(arm.measured(), None))
        if p.faults:
            break
    assert set(p.faults) == {PANDA.joints[joint]} and k < 400


@pytest.mark.long
@pytest.mark.parametrize("joint", [1, 4])
@pytest.mark.parametrize("dry", [0.03, 0.09])
def test_a_joint_that_dry_friction_holds_is_healthy(joint, dry, tmp_path):
    """Nobody knows how a soft servo sticks until it has moved; its lead grows until it comes loose."""
    robot = stranger(tmp_path)
    arm = arm_of(robot, FAST, 25.0)
    arm.dry[joint] = dry * 25.0**2
    assert Motion(robot, arm, FAST, 4.0, task=POSITION).is_calm


@pytest.mark.parametrize("wn", [19.0, 25.0, 63.0])
def test_a_joint_of_whose_servo_nothing_is_known_keeps_its_speed_limit(wn):
    """It was sped up as hard as it may be, and led by more than its limit: it went at 1.13 times that."""
    p, arm = started(PANDA, dt=2 * FAST, drive=ftqp.Drive(takes_velocity=False)), arm_of(PANDA, 2 * FAST, wn)
    target, fast = ftqp.Target(pose=PANDA.pose(PANDA.neutral + 2.0 * (np.arange(7) == 0))), 0.0
    for _ in range(600):
        arm.command(p.step(arm.measured(), None, target))
        fast = max(fast, float((np.abs(arm.v) / PANDA.limits.v_max).max()))
    assert p.stopped_because is None and not p.findings
    assert 0.9 < fast < 1.0


@pytest.mark.parametrize("wn", [20.0, 38.0])
def test_a_belief_moves_no_command_faster_than_its_joint_may_go(wn):
    """What was learned of the lag came into the command of a joint near its limit, at 2.7 times it."""
    top, angle, v, sent = PANDA.limits.v_max[0], 0.0, 0.0, []
    p, arm = started(PANDA, dt=FAST, drive=ftqp.Drive(takes_velocity=False)), arm_of(PANDA, FAST, wn)
    for k in range(1500):
        v = min(0.9 * top, 8.0 * k * FAST)
        angle += FAST * v
        q = PANDA.neutral + angle * (np.arange(7) == 0)
        step = p.step(arm.measured(), None, ftqp.Target(pose=PANDA.pose(q)))
        sent.append(step.q[0])
        arm.command(step)
    assert np.abs(np.diff(sent)).max() < 0.75 * top * FAST


def test_a_command_is_not_led_against_its_acceleration():
    """A rotor below zero, which noise may teach, drew it back, and threw it forth where the joint braked."""
    n = PANDA.nv
    values, deviations = np.zeros((n, 6)), np.full((n, 6), 1e-6)
    values[:, 1] = -2e-3
    known = LearnedServos(
        robot=PANDA.name, joints=PANDA.joints, units=("rad",) * n, values=values, deviations=deviations,
        droop=np.zeros(n), droop_error=np.zeros(n), noise=np.zeros(n), way=np.ones(n),
    )  # fmt: skip
    p, arm = started(PANDA, dt=FAST, drive=ftqp.Drive(known=known)), arm_of(PANDA, FAST, 250.0)
    for k in range(200):
        q = PANDA.neutral + 2.0 * (k * FAST) ** 2 * (np.arange(7) == 0)
        step = p.step(arm.measured(), None, ftqp.Target(pose=PANDA.pose(q)))
        arm.command(step)
        if step.reference.a[0] > 0.4:
            assert step.q[0] > step.reference.q[0] - 5e-4


@pytest.mark.parametrize("dt", [FAST, SLOW])
def test_an_arm_that_an_unknown_load_draws_away_at_first_is_healthy(dt):
    """Nothing is known of a servo yet, and it falls until it holds the load: no motor was believed off."""
    arm = arm_of(PANDA, dt, 25.0)
    arm.push[1], arm.push[3] = 0.08 * 25.0**2, -0.08 * 25.0**2
    motion = Motion(PANDA, arm, dt, 4.5)
    assert motion.is_calm and motion.error[-1] < 1e-3


class OvercomeArm(ServoArm):
    """Its fourth motor gives what it can, and cannot lift its load; oil slows that joint."""

    def advance(self, a, h):
        a[3] = np.clip(a[3], -5.0, 5.0) - 5.0 - 20.0 * self.v[3]
        super().advance(a, h)


def test_a_joint_whose_motor_its_load_overcomes_is_not_called_locked():
    """Its servo rested at its torque limit, and was learned and judged as if it had none."""
    tau_max = PANDA.limits.tau_max.copy()
    tau_max[3] = PANDA_WEIGHT
    arm = OvercomeArm(posture(PANDA), FAST, takes="position only", wn=63.0, sigma=2e-5)
    assert Motion(PANDA.with_limits(tau_max=tau_max), arm, FAST, 3.0).is_calm


class LateMotors(ServoArm):
    """Servos on velocities whose torque comes late: v (1 + c s + m s^2) = v_sent, m = c 0.125 s."""

    a = 0.0

    def advance(self, a, h):
        self.a = self.a + min(8.0 * h, 1.0) * (a - self.a)
        super().advance(self.a, h)


def test_the_loop_of_a_velocity_arm_does_not_shake_servos_that_are_slower_than_it():
    """Not told of them it has 10 1/s, at which an integrator behind such a servo swings without end."""
    arm = LateMotors(posture(PANDA), FAST, takes="velocity", wn=10.0, sigma=2e-5)
    motion = Motion(PANDA, arm, FAST, 4.0, drive="velocity")
    assert motion.is_calm and motion.error[-1] < 2e-3


class PushedArm(ServoArm):
    """A soft wrist that something pushes for half a second, farther than its motor could hold it."""

    ticks = 0

    def advance(self, a, h):
        self.ticks += 1
        a[4] += 60.0 if 1.2 <= self.ticks * h < 1.7 else 0.0
        super().advance(a, h)


@pytest.mark.parametrize("wn", [20.0, 40.0])
def test_a_push_that_moves_a_soft_wrist_accuses_no_joint(wn):
    """It seemed to be without motor while it went, and locked while it was held away."""
    arm = PushedArm(posture(PANDA), FAST, takes="position only", wn=wn, sigma=2e-5)
    motion = Motion(PANDA, arm, FAST, 4.0)
    assert motion.is_calm and motion.error[-1] < 1e-3


def without(first, last, spoil, **planner):
    """A motion of which samples are spoilt from step ``first`` to ``last``."""
    sees = lambda k, q: spoil(q) if first <= k < last else q  # noqa: E731
    return Motion(PANDA, arm_of(PANDA, FAST, 63.0), FAST, 4.0, sees=sees, **planner)


def test_an_arm_waits_while_no_joint_says_a_number():
    motion = without(1000, 1300, lambda q: np.full_like(q, np.nan))
    assert motion.is_calm and motion.error[-1] < 1e-3
    assert set(motion.said[1000:1300]) == {ftqp.StepStatus.INVALID_INPUT}
    assert motion.said[-1] == ftqp.StepStatus.OK


def test_samples_that_come_late_all_together_accuse_nobody():
    """The arm goes on meanwhile, so that all of them jump in the end: no sensor has failed."""
    kept = []

    def spoil(q):
        kept.append(q)
        return kept[0].copy()

    motion = without(1000, 1080, spoil)
    assert motion.is_calm and motion.error[-1] < 1e-3


def test_an_arm_whose_line_stays_dead_is_stopped():
    p = without(1000, 2500, lambda q: np.full_like(q, np.nan)).planner
    assert p.stopped_because is not None and "sensor" in p.stopped_because and not p.faults


def jumped(q):
    q[3] += 0.1
    return q


def dead(q):
    q[3] = np.nan
    return q


@pytest.mark.parametrize(("spoil", "kind"), [(jumped, "sensor_biased"), (dead, "sensor_dropped")])
def test_a_joint_whose_sensor_is_lost_is_held_by_its_servo_and_the_others_go_on(spoil, kind):
    motion = without(1000, 10**6, spoil, task=POSITION)
    assert motion.planner.stopped_because is None and set(motion.planner.faults) == {PANDA.joints[3]}
    (finding,) = motion.planner.findings
    assert finding.kinds == {kind} and finding.detected_at < 1.1
    assert motion.error[-1] < 1e-3 and motion.said[-1] == ftqp.StepStatus.OK


@pytest.mark.parametrize("spoil", [jumped, dead])
def test_a_sensor_that_is_lost_stops_an_arm_that_only_guards(spoil):
    p = without(1000, 10**6, spoil, task=POSITION, detector=False).planner
    assert PANDA.joints[3] in p.stopped_because and not p.faults


def test_a_sensor_of_a_joint_that_swings_freely_still_stops_the_arm():
    """Nobody holds such a joint where it was sent."""
    arm, p = arm_of(PANDA, FAST, 63.0), started(PANDA, dt=FAST, task=POSITION)
    targets = targets_along(ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.06, duration=3.0), 900, FAST)
    for k in range(900):
        if k == 500:
            p.report(ftqp.FreeSwinging(6))
        q = arm.measured()
        q[6] = np.nan if k >= 700 else q[6]
        arm.command(p.step(q, None, targets.at(k)))
    assert p.stopped_because is not None and PANDA.joints[6] in p.stopped_because


@pytest.mark.parametrize("turn", [2.0 * np.pi, -2.0 * np.pi])
def test_a_sensor_that_begins_anew_after_a_turn_is_followed(turn):
    def spoil(q):
        q[2] += turn
        return q

    motion = without(1000, 3000, spoil)
    assert motion.is_calm and motion.error[-1] < 1e-3
    assert ftqp.StepStatus.INVALID_INPUT not in motion.said


def test_a_joint_that_is_a_turn_off_from_the_start_is_not_followed():
    turned = 2.0 * np.pi * (np.arange(7) == 2)
    motion = Motion(PANDA, arm_of(PANDA, FAST, 63.0), FAST, 0.1, sees=lambda k, q: q + turned)
    assert list(motion.planner.faults) == [PANDA.joints[2]]
    assert "encoder whose numbers have jumped" in motion.planner.findings[0].sentence
    assert np.abs(motion.step.q - PANDA.neutral).max() < 1e-2


def test_gaps_in_the_samples_accuse_nobody():
    def sees(k, q):
        if k % 400 > 390:
            q[k // 400 % 7] = np.nan
        return q

    motion = Motion(PANDA, arm_of(PANDA, FAST, 63.0), FAST, 3.0, sees=sees)
    assert motion.planner.stopped_because is None and not motion.planner.faults


def test_a_finding_is_logged_in_a_sentence(caplog):
    with caplog.at_level(logging.WARNING, logger="ftqp"):
        Motion(PANDA, arm_of(PANDA, FAST, 63.0), FAST, 2.0, event=3)
    said = [record.getMessage() for record in caplog.records if PANDA.joints[3] in record.getMessage()]
    assert said and "does not move" in said[0]


def test_true_is_a_detector_on_every_drive():
    for drive in ("position", "velocity", "torque"):
        assert started(PANDA, dt=FAST, drive=drive, detector=True).diagnosis is not None


@pytest.mark.parametrize(("sigma", "encoder"), [(2e-4, None), (2e-5, 1.5e-3)], ids=["noise", "coarse"])
def test_noise_of_encoders_does_not_hide_what_a_rotor_takes(sigma, encoder):
    """In the estimate's own terms it drew m to nothing, and what a joint then took looked like a fault."""
    dt, wn, rng = 4e-3, 40.0, np.random.default_rng(1)
    p, arm = started(PANDA, dt=dt, drive=ftqp.Drive(takes_velocity=False)), arm_of(PANDA, dt, wn, sigma=sigma)
    for _ in range(10):
        motion = ftqp.GoTo(p, q=PANDA.neutral + rng.uniform(-0.4, 0.4, PANDA.nv))
        while not motion.done:
            q = arm.measured()
            arm.command(motion.step(q if encoder is None else encoder * np.round(q / encoder)))
    assert not p.findings and p.stopped_because is None
    assert 0.5 < np.mean(p.learned.values[:, 1]) * wn**2 < 1.2


def test_a_joint_that_creeps_against_its_friction_learns_no_droop():
    """What held it as it crept one way was taken for a droop, and when it turned it was called locked."""
    dt, wn, dry, angle, swing = 2 * FAST, 40.0, 0.01, 0.0, 0.0
    p = started(PANDA, dt=dt, drive=ftqp.Drive(takes_velocity=False))
    arm = arm_of(PANDA, dt, wn, sigma=1e-4)
    arm.dry[0] = dry * wn**2
    for k in range(5000):
        t = dt * k
        if t < 4.0:
            swing = 0.4 * np.sin(np.pi * t)
        else:
            swing += np.clip((0.025 if t < 7.0 else -0.025) - swing, -2e-3, 2e-3)
        angle += dt * swing
        pose = PANDA.pose(PANDA.neutral + angle * (np.arange(7) == 0))
        arm.command(p.step(arm.measured(), None, ftqp.Target(pose=pose)))
        if k == 3500:
            friction, droop = p.learned.values[0, 2:4]
            assert abs(friction - dry) < 3e-3 and abs(droop) < 3e-3
    assert not p.findings


@pytest.mark.parametrize(("joint", "rate"), [(0, 2e-3), (6, 2e-3), (6, 1e-2)])
def test_a_frozen_encoder_of_a_joint_that_nearly_rests_leads_no_velocity_arm_away(joint, rate):
    """The loop took the error that never became less for one to make up for: 3 rad, and OK was said."""
    dt, angle, worst, frozen = 4 * FAST, 0.0, 0.0, np.nan
    p = started(PANDA, dt=dt, drive=ftqp.Drive(kind="velocity"))
    arm = arm_of(PANDA, dt, 40.0, "velocity", 4.4e-5)
    for k in range(2500):
        t = dt * k
        angle += dt * (0.3 * np.sin(np.pi * t) if t < 4.0 else rate if t > 5.0 else 0.0)
        q, y = PANDA.neutral + angle * (np.arange(7) == joint), 1e-5 * np.round(arm.measured() / 1e-5)
        if t > 4.5:
            frozen = y[joint] if np.isnan(frozen) else frozen
            y[joint] = frozen
            worst = max(worst, abs(arm.q[joint] - q[joint]))
        arm.command(p.step(y, None, ftqp.Target(pose=PANDA.pose(q))))
    assert set(p.faults) == {PANDA.joints[joint]} and worst < 0.15
