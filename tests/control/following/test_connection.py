"""The first motion with an arm shows its servos, and what is wrong with its wires, units and signs."""

import logging
from types import SimpleNamespace

import numpy as np
import pytest
from tests.going import started
from tests.servo_arm import ServoArm

import ftqp
from ftqp.control.following.connection_words import strayed
from ftqp.sim.plants.joint_servo import Gains, GainServo

DT, SIGMA = 0.005, 5e-5
TABLE = [(0.0, 0.3, 0.0, np.pi / 2), (0.0, 0.0, 0.4, 0.0), (0.0, 0.1, 0.0, -np.pi / 2), (0.0, 0.3, 0.1, 0.0)]
"""An arm that nobody has seen before."""
STRANGE = ftqp.Robot.from_dh(
    TABLE, name="strange", joints=["waist", "lift", "roll", "bend"],
    limits={"q_min": -2.5, "q_max": 2.5, "v_max": 2.0, "a_max": 15.0},
)  # fmt: skip
START = np.array([0.4, -0.7, 0.9, 0.5])
WN = np.array([25.0, 40.0, 60.0, 120.0])
POSITIONS = ftqp.Drive(takes_velocity=False)


def made(drive=POSITIONS, dt=DT, **options):
    return ftqp.Planner(STRANGE, dt, task=ftqp.Task(rows="position"), drive=drive, **options)


def connected(
    planner=None, read=lambda q: q, send=lambda q: q, event=None, start=START, sag=0.0, takes="position only",
    sigma=SIGMA,
):  # fmt: skip
    """The connection with an arm of four different servos after its first motion, and the arm."""
    planner = planner or made()
    arm = ServoArm(start, DT, takes, wn=WN, sigma=sigma)
    arm.push = -(WN**2) * sag
    first = ftqp.connect(planner, read(arm.measured()))
    k = 0
    while not first.done:
        if event is not None:
            event(k * DT, arm)
        step = first.step(read(arm.measured()))
        arm.command(SimpleNamespace(q=send(np.array(step.q)), v=np.array(step.v)))
        k += 1
    arm.seconds = k * DT
    return first, arm


@pytest.fixture(scope="module")
def healthy():
    return connected(sag=0.02)


def test_servos_of_an_arm_that_nobody_has_described_are_learned(healthy):
    first, arm = healthy
    learned = first.learned
    assert first.fault is None and first.progress == 1.0 and arm.seconds < 11.5
    expected = 2.0 / WN - 0.5 * DT  # a command is there for half a period, in the mean, before it is due
    assert (np.abs(learned.lag - expected) < 3.0 * learned.lag_error).all()
    assert (learned.lag_error < 0.01).all() and learned.is_known.all()
    np.testing.assert_allclose(learned.droop, 0.02, atol=1e-3)
    np.testing.assert_allclose(learned.noise, SIGMA, rtol=0.3)
    assert "waist lags by" in learned.sentences[0]
    np.testing.assert_allclose(arm.q, START - 0.0, atol=2e-3)  # droop that was learned is made up for


class Sticky(ServoArm):
    """Servos with dry friction, by which a joint stays behind [rad]."""

    friction = 0.0

    def advance(self, a, h):
        free, most = self.v + h * a, h * self.wn**2 * self.friction
        super().advance((np.sign(free) * np.maximum(np.abs(free) - most, 0.0) - self.v) / h, h)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(8))
def test_lag_friction_and_droop_are_within_three_stated_deviations_of_what_servos_have(seed):
    rng = np.random.default_rng(seed)
    dt, late = rng.choice([1e-3, 2e-3, 5e-3, 1e-2]), int(rng.integers(3))
    wn = 2.0 * np.pi * np.exp(rng.uniform(np.log(3.0), np.log(60.0), 4))
    sag, sigma = rng.uniform(-1.0, 1.0, 4) * np.minimum(0.03, 20.0 / wn**2), rng.choice([1e-6, 1e-5, 5e-5])
    arm = Sticky(START, dt, "position only", wn=wn, latency=late, sigma=sigma, seed=seed)
    arm.push, arm.friction = -(wn**2) * sag, rng.choice([0.0, 3e-4, 1e-3])
    first = ftqp.connect(made(dt=dt), arm.measured())
    while not first.done:
        arm.command(first.step(arm.measured()))
    learned = first.learned
    assert first.fault is None and learned.is_known.all() and (learned.lag_error < 0.01).all()
    assert (np.abs(learned.lag - (2.0 / wn + (late - 0.5) * dt)) < 3.0 * learned.lag_error).all()
    assert (np.abs(learned.friction - arm.friction) < 3.0 * learned.friction_error).all()
    held = arm.friction  # to either side, where it stands
    assert (np.abs(learned.droop - sag) < 3.0 * learned.droop_error + held).all()


def test_it_says_what_is_noticed_and_what_is_missing(healthy):
    first, _ = healthy
    assert len(first.notices) == 4 and all("nothing shows" in said for said in first.notices)
    missing = " ".join(first.missing)
    assert "ftqp.Noise(q=" in missing and "no masses" in missing
    assert all(part in str(first) for part in (*first.learned.sentences, *first.notices, *first.missing))


def test_the_planner_goes_on_with_what_was_learned_and_another_begins_with_its_file(healthy, tmp_path):
    first, _ = healthy
    file = tmp_path / "arm.json"
    first.save(file)
    planner = made(ftqp.Drive(takes_velocity=False, known=file))
    planner.reset(START)
    arm = ServoArm(START, DT, "position only", wn=WN, sigma=SIGMA)
    for _ in range(3):
        arm.command(planner.step(arm.measured(), None, ftqp.Target(pose=STRANGE.pose(START))))
    np.testing.assert_allclose(planner.learned.lag, first.learned.lag, atol=1e-3)
    assert planner.learned.is_known.all()
    first.planner.reset(START)  # which forgets all but what was told
    for _ in range(3):
        arm.command(first.planner.step(arm.measured(), None, ftqp.Target(pose=STRANGE.pose(START))))
    np.testing.assert_allclose(first.planner.learned.lag, planner.learned.lag, atol=1e-3)


@pytest.mark.long
@pytest.mark.parametrize("speed", [0.1, 1.0])
@pytest.mark.parametrize("joint", range(4))
def test_a_lock_is_found_about_when_that_was_said(speed, joint):
    planner = made()
    arm = connected(planner)[1]
    said = planner.diagnosis.sight.lock_after(joint, speed)
    planner.speed = speed / STRANGE.limits.v_max[joint]
    goto = ftqp.GoTo(planner, q=START + 1.5 * np.array([1.0, -1.0, -1.0, 1.0]))
    k = 0
    while not planner.findings:
        arm.braked[joint] = k > 200
        arm.command(goto.step(arm.measured()))
        k += 1
    after = (k - 200) * DT
    assert planner.findings[0].joint == STRANGE.joints[joint]
    assert 0.4 * said < after < 2.0 * said + 0.05  # friction, which counts where a joint stands, comes late


def swapped(q):
    return q[[0, 2, 1, 3]]


@pytest.mark.long
@pytest.mark.parametrize("start", [START, np.array([0.4, 0.6, 0.61, 0.5])])
@pytest.mark.parametrize("where", ["read", "send"])
def test_swapped_columns_are_named(where, start):
    first, arm = connected(**{where: swapped}, start=start)
    assert "lift" in first.fault and "roll" in first.fault and "are swapped" in first.fault
    assert np.abs(arm.q - start).max() < 0.15 or arm.seconds < 0.3


@pytest.mark.long
@pytest.mark.parametrize("start", [START, np.array([0.4, -0.7, 0.01, 0.5])])
def test_a_wrong_sign_is_named(start):
    first, arm = connected(read=lambda q: q * [1.0, 1.0, -1.0, 1.0], start=start)
    assert "roll" in first.fault and "turn the sign" in first.fault
    assert np.abs(arm.q - start).max() < 0.15 or arm.seconds < 0.3


@pytest.mark.parametrize(
    ("full_turn", "said"),
    [
        (360.0, r"as degrees from 0 to 360 all joints are inside: .*np.radians\(\(q \+ 180\) % 360 - 180\)"),
        (2.0 * np.pi, r"a turn less or more, all joints are inside: hand over angles from -pi to pi"),
    ],
)
def test_angles_that_begin_at_zero_are_named(full_turn, said):
    """As Kinova's API gives them."""
    panda = ftqp.robots.load("panda")
    q = np.mod(panda.neutral / (2.0 * np.pi), 1.0) * full_turn
    with pytest.raises(ftqp.InputError, match=said):
        ftqp.connect(ftqp.Planner(panda, 2e-3), q)


def test_degrees_are_named():
    with pytest.raises(ftqp.InputError, match=r"q puts roll at 51.* as degrees all joints are inside"):
        ftqp.connect(made(), np.degrees(START))
    near = np.array([0.01, -0.012, 0.008, 0.011])
    said = connected(read=np.degrees, start=near)[0].fault
    assert "degrees" in said and "radians" in said
    assert "send step.q as it is" in connected(send=np.degrees)[0].fault
    assert "as if the arm took degrees" in connected(send=np.radians)[0].fault


def test_two_columns_that_go_towards_zero_are_no_degrees():
    begun, way = np.array([0.1, -1.2, 0.9, 1.4]), np.array([0.0, 0.0, -0.2, -0.3])
    said = strayed(made().robot.joints, begun, way)
    assert "degrees" not in said and "order of the columns" in said


def test_samples_of_degrees_about_zero_go_too_far():
    said = connected(read=np.degrees, start=np.zeros(4), sigma=0.0)[0].fault
    assert "times as far: they seem to be in degrees" in said


def test_an_arm_that_is_locked_or_held_from_the_first_is_named_and_nothing_is_written(tmp_path):
    def lock(t, arm):
        arm.braked[1] = True

    first, arm = connected(event=lock)
    assert "lift" in first.fault and "locked" in first.fault
    with pytest.raises(ftqp.InputError, match=r"arm.json is not written, because the first motion was ended"):
        first.save(tmp_path / "arm.json")
    assert not (tmp_path / "arm.json").exists() and str(first).startswith("Ended early: lift")
    assert first.planner.stopped_because is not None and first.missing == ()

    def hold(t, arm):
        arm.braked[:] = t > 1.0

    first, arm = connected(event=hold)
    assert first.fault is not None and arm.seconds < 5.0


def test_a_joint_that_fails_while_all_move_is_named():
    def lock(t, arm):
        arm.braked[2] = t > 7.5

    first, _ = connected(event=lock)
    assert "roll" in first.fault


@pytest.mark.long
@pytest.mark.parametrize(("bandwidth", "seen"), [(10.0 * WN[2], 1.0), (0.1 * WN[2], 1.0)])
def test_a_bandwidth_that_is_stated_ten_times_too_large_or_small_is_said(bandwidth, seen):
    first, _ = connected(made(ftqp.Drive(takes_velocity=False, bandwidth=bandwidth)))
    assert first.fault is None
    said = next(one for one in first.missing if "bandwidth" in one)
    assert f"{bandwidth:.3g} rad/s" in said and "roll" in said and "leave the bandwidth out" in said
    assert abs(first.learned.lag[2] - 2.0 / WN[2]) < 0.01


@pytest.mark.long
def test_velocities_that_the_drive_does_not_take_are_said():
    first, _ = connected(made(ftqp.Drive()))
    assert any("takes_velocity=False" in one and "waist" in one for one in first.missing)
    first, _ = connected(made(ftqp.Drive(bandwidth=WN.tolist())), takes="position")
    assert not any("takes_velocity" in one or "bandwidth" in one for one in first.missing)


def test_samples_that_are_the_commands_teach_nothing(tmp_path):
    planner = made()
    first = ftqp.connect(planner, START)
    q = START
    while not first.done:
        q = np.array(first.step(q).q)
    assert first.learned is None and planner.learned is None
    assert "the commands to the last bit" in first.missing[0]
    np.testing.assert_allclose(q, START, atol=1e-9)
    with pytest.raises(ftqp.InputError, match="is not written: The samples were the commands"):
        first.save(tmp_path / "arm.json")


def test_a_joint_that_is_said_to_have_failed_stands_and_is_said_to_be_unknown():
    planner = made()
    planner.report(ftqp.Locked("roll"))

    def lock(t, arm):
        arm.braked[2] = True

    first, _ = connected(planner, event=lock)
    assert first.fault is None and not first.learned.is_known[2]
    assert any("Nothing was estimated of roll, which hardly moved" in one for one in first.missing)


def test_what_cannot_be_connected_is_refused_in_a_sentence():
    with pytest.raises(ftqp.InputError, match=r"planner is 'panda', expected an ftqp.Planner"):
        ftqp.connect("panda", START)
    with pytest.raises(ftqp.InputError, match="drive is 'velocity', expected 'position': connect estimates"):
        ftqp.connect(made("velocity"), START)
    with pytest.raises(ftqp.InputError, match="seconds is 1, expected at least"):
        ftqp.connect(made(), START, seconds=1.0)
    with pytest.raises(ftqp.InputError, match=r"q puts lift at 3, far outside its range .* order of the col"):
        ftqp.connect(made(), [0.0, 3.0, 0.0, 2.6])
    first = ftqp.connect(made(), START)
    with pytest.raises(ftqp.InputError, match="100% of the motion is still to come"):
        first.save("arm.json")


@pytest.fixture(autouse=True)
def quiet():
    """Warnings of arms that are wired wrongly are not looked at here."""
    logging.disable(logging.WARNING)
    yield
    logging.disable(logging.NOTSET)


class SoftArm:
    """An xArm7 in physics: servos of 4 Hz that know no weight, rotors, friction, noise; it has sagged."""

    def __init__(self, seed):
        pytest.importorskip("mujoco")
        self.rng = rng = np.random.default_rng(seed)
        self.robot = robot = ftqp.robots.load("xarm7").with_limits(v_max=2.0, a_max=10.0, tau_max=80.0)
        rotors = rng.uniform(0.1, 0.4, 7)
        rotors[-3:] *= 0.3
        w, real = 2 * np.pi * rng.uniform(4.0, 4.6, 7), robot.with_rotors(rotors)
        dry = np.diag(real.mass_matrix(robot.neutral)) * w * w * rng.uniform(0.5e-3, 3e-3, 7)
        named = [dict(zip(robot.joints, numbers, strict=True)) for numbers in (w, rotors, dry)]
        late = rng.integers(2, 20) * 0.0005
        gains = Gains(bandwidth=named[0], damping=0.9, weight=False, takes_velocity=False, delay=late)
        servo = GainServo(real, "position", gains, DRAWN_DT / 8)
        true = ftqp.TrueArm(rotors=named[1], coulomb=named[2])
        self.plant = ftqp.MujocoPlant(robot, DRAWN_DT, servo, true, substeps=8)
        self.plant.reset(robot.neutral, np.zeros(7))
        for _ in range(250):
            self.plant.advance(
                SimpleNamespace(q=robot.neutral, v=np.zeros(7), tau=np.zeros(7), brakes=np.zeros(7, bool))
            )

    def measured(self):
        return self.plant.q + 1e-4 * self.rng.standard_normal(7)

    def connected(self):
        planner = ftqp.Planner(self.robot, DRAWN_DT, drive=ftqp.Drive(takes_velocity=False))
        first = ftqp.connect(planner, self.measured())
        while not first.done:
            self.plant.advance(first.step(self.measured()))
        return first


DRAWN_DT = 0.004
FAR = np.array([-5.08, 0.68, -3.94, 3.5, 4.85, 0.51, 0.45])
NEAR = np.array([-0.07, -0.23, 0.02, 1.88, 2.05, 1.07, 0.28])


@pytest.mark.parametrize("seed", [3, 8])
def test_a_soft_arm_that_sags_at_first_is_not_said_to_be_wired_wrongly(seed):
    assert SoftArm(seed).connected().fault is None


@pytest.mark.long
@pytest.mark.parametrize("seed", [22, 33, 39])
def test_a_joint_that_the_others_push_back_as_all_begin_is_not_accused(seed):
    """Whether m is a rotor's or the links', a first motion cannot tell; the others' motion shows it."""
    arm = SoftArm(seed)
    first, robot = arm.connected(), arm.robot
    drive = ftqp.Drive(takes_velocity=False, known=first.learned)
    planner = started(robot, dt=DRAWN_DT, at=arm.measured(), drive=drive)
    for goal in (NEAR, FAR, NEAR, FAR):
        q = np.clip(goal, robot.limits.q_min + 0.02, robot.limits.q_max - 0.02)
        motion, ticks = ftqp.GoTo(planner, q=q), 0
        while not motion.done and ticks < 2000:
            arm.plant.advance(motion.step(arm.measured()))
            ticks += 1
    assert not planner.findings and planner.stopped_because is None
