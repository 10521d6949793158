"""What the arm takes: joint drives, what is sent to them, and the bandwidths that follow."""

import numpy as np
import pinocchio
import pytest
from tests.going import targets_along
from tests.ride import DT as MILLISECOND
from tests.ride import START, circle, target_at
from tests.servo_arm import ServoArm, TorqueArm

import ftqp
from ftqp.control.drive.identification import servo_lag
from ftqp.control.drive.joint_drive import Drive, asked, by_name
from ftqp.control.planner.step_parts import Reference

QUIET = ftqp.Noise()


def loops(drive, dt=1e-3):
    gains = drive.gains(dt, QUIET, 0.9)
    return gains, (drive.ticks(dt) + 1) * dt


def sensitivity(loop):
    """Largest |1/(1 + L)| over the frequencies."""
    s = 1j * np.geomspace(0.05, 1500.0, 40000)
    return np.abs(1.0 / (1.0 + loop(s))).max()


@pytest.mark.parametrize("latency", [0.0, 2e-3, 5e-3])
@pytest.mark.parametrize("hertz", [5, 15, 60])
@pytest.mark.parametrize("takes_velocity", [True, False])
def test_the_loop_of_the_tip_has_its_margin(latency, hertz, takes_velocity):
    wn = 2 * np.pi * hertz
    gains, delay = loops(Drive(bandwidth=wn, takes_velocity=takes_velocity, latency=latency))
    kappa = gains["kappa"]

    def loop(s):
        servo = (2 * wn * s + wn**2 if takes_velocity else wn**2) / (s + wn) ** 2
        if not takes_velocity:
            servo = servo * (1.0 + gains["lead"] * s)
        return kappa**2 * servo * np.exp(-s * delay) / (s * (s + 2 * kappa))

    assert sensitivity(loop) < 2.0


@pytest.mark.parametrize("latency", [0.0, 2e-3, 5e-3])
@pytest.mark.parametrize("hertz", [15, 60])
def test_the_position_loop_of_a_velocity_arm_has_its_margin(latency, hertz):
    wv = 2 * np.pi * hertz
    gains, delay = loops(Drive(kind="velocity", bandwidth=wv, latency=latency))
    assert sensitivity(lambda s: gains["hold"] * wv / (s + wv) * np.exp(-s * delay) / s) < 2.0


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("velocty", "drive is 'velocty' (did you mean 'velocity'?), expected one of"),
        ({"bandwidth": -1.0}, "bandwidth of the drive is -1"),
        ({"bandwidth": float("nan")}, "bandwidth of the drive is nan"),
        ({"kind": "velocity", "lead": 0.1}, "lead is for drive 'position', but the drive is 'velocity'"),
        ({"stiffness": 10.0}, "stiffness is for drive 'torque', but the drive is 'position'"),
        ({"kind": "torque", "takes_velocity": False}, "takes_velocity=False is for drive 'position'"),
        ({"takes_velocity": "no"}, "takes_velocity of the drive is 'no', expected True or False"),
    ],
)
def test_a_wrong_drive_is_one_sentence(given, sentence):
    with pytest.raises(ftqp.InputError) as error:
        by_name(given)
    assert sentence in str(error.value)


def test_too_much_latency_and_a_robot_without_inertia_are_refused():
    robot = ftqp.robots.load("panda")
    with pytest.raises(ftqp.InputError, match=r"latency of the drive is 1 s, expected at most 0\.062 s"):
        ftqp.Planner(robot, drive=Drive(latency=1.0))
    with pytest.raises(ftqp.InputError, match="drive 'torque' needs inertia, which srs7 has not"):
        ftqp.Planner(ftqp.robots.load("srs7"), drive="torque")
    with pytest.raises(ftqp.InputError, match="noise is 3, expected an"):
        ftqp.Planner(robot, noise=3)


def shaken(w, poles, noise, dt=1e-3, ticks=40000):
    """Standard deviation of the acceleration that noise asks for, simulated."""
    rng = np.random.default_rng(0)
    q = v = d = 0.0
    wanted = []
    for sample in noise * rng.standard_normal(ticks):
        q, v = q + dt * v + 0.5 * dt * dt * d, v + dt * d
        e = sample - q
        q, v = q + (1.0 - poles**3) * e, v + 1.5 * (1.0 - poles) ** 2 * (1.0 + poles) / dt * e
        d += (1.0 - poles) ** 3 / dt**2 * e
        wanted.append(w * w * q + 2.0 * w * v)
    return float(np.std(wanted))


@pytest.mark.parametrize("x", [1.5, 2.0, 5.0])
def test_noise_asks_for_as_much_acceleration_as_a_simulated_observer_says(x):
    w, dt = 80.0, 1e-3
    assert asked(w, x, np.sqrt(dt)) == pytest.approx(shaken(w, np.exp(-x * w * dt), 1.0), rel=0.1)


def test_observer_of_a_torque_arm_is_so_slow_that_noise_alone_does_not_jolt_it():
    drive = Drive(kind="torque", stiffness=80.0)

    def pole(q, **given):
        return drive.gains(1e-3, ftqp.Noise(q=q), 0.9, **given)["pole"]

    exact, noisy = pole(0.0, a_max=7.0), pole(1e-4, a_max=7.0)
    assert shaken(80.0, exact, 1e-4) > 5.0
    assert shaken(80.0, noisy, 1e-4) == pytest.approx(0.2 * 7.0, rel=0.05)
    assert pole(1e-5, a_max=7.0) == pole(1e-4) == exact
    assert drive.gains(1e-3, ftqp.Noise(q=1e-4), 0.9, 7.0)["stiffness"] == 80.0


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-2])
def test_loop_of_a_torque_arm_has_its_margin_whatever_the_noise(noise):
    gains = Drive(kind="torque").gains(1e-3, ftqp.Noise(q=noise), 0.9, 7.0)
    w, wo, c = gains["stiffness"], -np.log(gains["pole"]) / 1e-3, 0.5 * gains["stiffness"]

    def loop(s):
        """The observer knows what was sent: q^ = q_seen position + ..., and so on."""
        disturbance = (wo / (s + wo)) ** 3
        position = 1.0 - (s / (s + wo)) ** 3
        speed = s * (3.0 * wo**2 * s + wo**3) / (s + wo) ** 3
        forward = c / (s + c) * disturbance
        back = w * w * position + 2.0 * w * speed + forward * s * s
        known = 1.0 + w * w * (1.0 - position) / s**2 + 2.0 * w * (s - speed) / s**2 - forward
        return back / known * np.exp(-s * 1e-3) / s**2

    assert sensitivity(loop) < 2.3


@pytest.mark.parametrize("kind", ["position", "velocity"])
def test_a_bandwidth_of_each_joint_is_that_of_the_slowest_in_loops_and_of_the_fastest_ahead(kind):
    each = [94.0, 94.0, 60.0, 94.0, 94.0, 120.0, 120.0]
    several, slow = ftqp.Drive(kind=kind, bandwidth=each), ftqp.Drive(kind=kind, bandwidth=60.0)
    assert several.gains(1e-3, ftqp.Noise(), 0.9) == slow.gains(1e-3, ftqp.Noise(), 0.9)
    ahead = ftqp.Drive(bandwidth=np.array(each), takes_velocity=False).gains(1e-3, ftqp.Noise(), 0.9)["lead"]
    assert ahead == 2.0 / 120.0
    assert ftqp.Drive(bandwidth=(50.0,) * 7).gains(1e-3, ftqp.Noise(), 0.9) == ftqp.Drive(
        bandwidth=50.0
    ).gains(1e-3, ftqp.Noise(), 0.9)


def test_an_arm_whose_servos_differ_follows_a_path_on_its_own_drive():
    robot = ftqp.robots.load("panda")
    each = np.array([94.0, 94.0, 60.0, 94.0, 94.0, 120.0, 120.0])
    planner = ftqp.Planner(robot, drive=ftqp.Drive(bandwidth=each, takes_velocity=False))
    q = robot.neutral.copy()
    planner.reset(q)
    path = ftqp.paths.Circle(robot.pose(q), radius=0.05, duration=2.0)
    targets = targets_along(path, 2000, 0.001)
    for k in range(2000):
        step = planner.step(q, None, targets.at(k))
        q = q + (step.q - q) * np.minimum(0.5 * each * 1e-3, 1.0)
    assert step.status.name == "OK"
    assert np.linalg.norm(robot.pose(q)[:3, 3] - path.sample(1.999).pose[0, :3, 3]) < 1e-3


@pytest.mark.parametrize(
    ("bandwidth", "words"),
    [
        ([94.0] * 6, r"shape \(6,\), expected \(nv,\) = \(7,\)"), ([94.0] * 6 + [0.0], "bandwidth"),
        ([], "shape"), ([[94.0] * 7], "shape"), ([94.0] * 6 + [np.nan], "bandwidth"),
    ],
)  # fmt: skip
def test_a_bandwidth_of_other_joints_is_refused(bandwidth, words):
    with pytest.raises(ftqp.InputError, match=words):
        ftqp.Planner(ftqp.robots.load("panda"), drive=ftqp.Drive(bandwidth=bandwidth))


DT = 2e-3


@pytest.mark.long
def test_lead_sends_no_position_beyond_the_range_that_is_left(level):
    """A slow servo on positions only is sent where it shall be 0.1 s later: that was beyond the end."""
    robot = ftqp.robots.load("panda")
    drive = ftqp.Drive(bandwidth=20.0, takes_velocity=False)
    planner = ftqp.Planner(
        robot, DT, level=level, drive=drive, emergency=None, task=ftqp.Task(rows="position")
    )
    arm = ServoArm(robot.neutral, DT, takes="position only", wn=20.0)
    planner.reset(arm.q)
    planner.report(ftqp.Degraded(1, q_max=0.5))
    top = robot.limits.q_max.copy()
    top[1] = 0.5
    rng = np.random.default_rng(0)
    led, most = 0.0, -np.inf
    for k in range(3000):
        if k % 500 == 0:
            pose = robot.pose(rng.uniform(robot.limits.q_min, robot.limits.q_max))
            pose[:3, 3] *= 1.3
        step = planner.step(arm.measured(), None, ftqp.Target(pose=pose))
        most = max(most, np.max(step.q - top), np.max(robot.limits.q_min - step.q))
        led = max(led, np.abs(step.q - step.reference.q).max())
        arm.command(step)
    assert led > 0.05
    assert most <= 1e-9


def test_velocity_arm_that_slips_as_fast_as_a_quarter_of_its_limit_is_held():
    """A wrist that an unknown load drew away stayed 16 mrad behind, and the path waited for it for ever."""
    robot = ftqp.robots.load("panda")
    drive = ftqp.Drive(kind="velocity", bandwidth=94.0)
    planner = ftqp.Planner(robot, DT, drive=drive, task=ftqp.Task(rows="position"))
    arm = ServoArm(robot.neutral, DT, takes="velocity", wn=94.0)
    arm.push[5] = 94.0 * 0.25 * robot.limits.v_max[5]
    planner.reset(arm.q)
    target = ftqp.Target(pose=robot.pose(robot.neutral))
    for _ in range(750):
        step = planner.step(arm.measured(), None, target)
        arm.command(step)
    assert np.abs(arm.q - step.reference.q).max() < 1e-3
    assert step.status.name == "OK"


def test_refused_sample_takes_feedback_of_a_velocity_arm_away_by_its_acceleration_limit():
    """A servo that slips under a load is sent more than the reference; a bad frame took all of it at once."""
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, level="velocity", drive="velocity")
    arm = ServoArm(robot.neutral, DT, takes="velocity")
    arm.push[:] = 15.0
    planner.reset(arm.q)
    target, extra, most = ftqp.Target(pose=robot.pose(robot.neutral)), np.zeros(7), 0.0
    for k in range(705):
        q = np.full(7, np.nan) if 700 <= k < 703 else arm.measured()
        step = planner.step(q, None, target)
        if 700 <= k < 703:
            assert np.abs(extra).max() > 0.05
            change = np.abs(step.v - step.reference.v - extra)
            most = max(most, float(np.max(change / (robot.limits.a_max * DT))))
        extra = step.v - step.reference.v
        arm.command(step)
    assert most <= 1.0 + 1e-9


def test_it_is_the_inverse_dynamics_of_the_corrected_acceleration():
    robot, rng = ftqp.robots.load("panda"), np.random.default_rng(3)
    q, v = START + 0.1 * rng.normal(size=7), 0.1 * rng.normal(size=7)
    reference = Reference(q + 1e-3 * rng.normal(size=7), v + 1e-2 * rng.normal(size=7), rng.normal(size=7))
    a = reference.a + 900.0 * (reference.q - q) + 60.0 * (reference.v - v)
    model, data = robot.model, robot.model.createData()
    expected = pinocchio.rnea(model, data, q, v, a)
    np.testing.assert_allclose(
        ftqp.ComputedTorque(robot, 30.0).torques(reference, q, v), expected, atol=1e-10
    )


@pytest.mark.slow
def test_it_holds_a_torque_arm_to_a_planner_that_sends_positions():
    robot = ftqp.robots.load("panda")
    planner, arm = ftqp.Planner(robot, MILLISECOND), TorqueArm(robot, START, MILLISECOND, mass=0.2)
    law, path, worst = ftqp.ComputedTorque(robot, bandwidth=60.0), circle(robot, START, 0.05, 2.0), 0.0
    planner.reset(START)
    for k in range(2000):
        target = target_at(path, k * MILLISECOND)
        step = planner.step(arm.q, None, target)
        worst = max(worst, np.linalg.norm(robot.pose(arm.q)[:3, 3] - target.position))
        sent = type("Sent", (), {"tau": law.torques(step.reference, arm.q, arm.v)})
        arm.command(sent)
    assert worst < 3e-3


def recorded(takes, hertz, latency=0, sigma=1e-4):
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, MILLISECOND)
    arm = ServoArm(START, MILLISECOND, takes, 2 * np.pi * hertz, latency=latency, sigma=sigma)
    planner.reset(START)
    path, sent, measured = circle(robot, START, 0.1, 3.0), [], []
    for k in range(2500):
        q = arm.measured()
        step = planner.step(q, None, target_at(path, k * MILLISECOND))
        arm.command(step)
        sent.append(step.q.copy())
        measured.append(q)
    return np.array(sent), np.array(measured)


@pytest.mark.long
@pytest.mark.parametrize(("hertz", "latency"), [(15, 0), (5, 5)])
def test_a_servo_on_positions_only_gets_its_lead(hertz, latency):
    true = 2.0 / (2 * np.pi * hertz)
    found = servo_lag(*recorded("position only", hertz, latency), MILLISECOND, latency=latency * MILLISECOND)
    assert found.lag == pytest.approx(true, rel=0.08)
    assert found.drive.lead == found.lag and not found.drive.takes_velocity


@pytest.mark.long
@pytest.mark.parametrize("hertz", [15, 60])
def test_a_servo_that_takes_velocities_has_no_lag(hertz):
    found = servo_lag(*recorded("position", hertz), MILLISECOND)
    assert abs(found.lag) < 2e-3 and found.drive == ftqp.Drive()
