"""Bases that move: poses, what moves them, what is measured of them, and runs on them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ftqp
from ftqp.core.pose import transform
from ftqp.sim.base.disturbances import RandomMotion, Recorded, Sinusoid, Step
from ftqp.sim.base.moving_world import BaseMotion, FreeBase, MovingWorld, Platform, PoseSensor
from ftqp.sim.log.metrics import summary


def test_platform_is_track_rotation_and_tilt_in_that_order():
    track, turn, tilt = 0.4, 0.7, -0.3
    expected = (
        transform(np.eye(3), np.array([track, 0.0, 0.0]))
        @ transform(Rotation.from_euler("z", turn).as_matrix(), np.zeros(3))
        @ transform(Rotation.from_euler("y", tilt).as_matrix(), np.array([0.0, 0.0, 0.30]))
        @ transform(np.eye(3), np.array([0.20, 0.0, 0.45]))
    )
    np.testing.assert_allclose(Platform().pose(np.array([[track, turn, tilt]]))[0], expected, atol=1e-15)


def test_free_base_is_a_position_and_a_rotation_vector():
    eta = np.array([[1.0, 2.0, 3.0, 0.1, -0.2, 0.3]])
    found = FreeBase().pose(eta)[0]
    np.testing.assert_array_equal(found[:3, 3], eta[0, :3])
    np.testing.assert_allclose(Rotation.from_matrix(found[:3, :3]).as_rotvec(), eta[0, 3:], atol=1e-15)


@pytest.fixture
def t():
    return 0.01 * np.arange(400)


def test_step_jumps_or_ramps_to_its_size(t):
    jump = Step("tilt", -0.3, at=1.0).sample(t)["tilt"]
    assert np.all(jump[t < 0.999] == 0.0) and np.all(jump[t > 0.999] == -0.3)
    ramp = Step("tilt", -0.3, at=1.0, rate=0.2).sample(t)["tilt"]
    assert ramp[100] == 0.0 and ramp[150] == pytest.approx(-0.1) and np.all(ramp[260:] == -0.3)


def test_sinusoid_starts_at_zero(t):
    wave = Sinusoid("x", 0.1, frequency=0.5, phase=0.7).sample(t)["x"]
    assert wave[0] == 0.0
    np.testing.assert_allclose(wave, 0.1 * (np.sin(np.pi * t + 0.7) - np.sin(0.7)), atol=1e-15)


def test_random_motion_has_its_rms_and_corner_and_repeats_for_its_seed():
    t = 0.02 * np.arange(200_000)
    first = RandomMotion("rz", 0.05, corner=0.5, generator=np.random.default_rng(3))
    value = first.sample(t)["rz"]
    assert value[0] == 0.0 and value[1000:].std() == pytest.approx(0.05, rel=0.05)
    np.testing.assert_array_equal(value, first.sample(t)["rz"])
    again = RandomMotion("rz", 0.05, corner=0.5, generator=np.random.default_rng(3))
    np.testing.assert_array_equal(value, again.sample(t)["rz"])
    lag = np.corrcoef(value[1000:-1], value[1001:])[0, 1]
    assert lag == pytest.approx(np.exp(-2 * np.pi * 0.5 * 0.02), rel=0.01)


def test_two_random_motions_of_one_generator_differ(t):
    generator = np.random.default_rng(3)
    a, b = (RandomMotion("x", 1.0, corner=1.0, generator=generator).sample(t)["x"] for _ in range(2))
    assert abs(np.corrcoef(a[1:], b[1:])[0, 1]) < 0.9 and not np.array_equal(a, b)


def test_recording_is_linear_between_samples_and_held_outside():
    found = Recorded([1.0, 2.0], {"x": [0.0, 0.4]}).sample(np.array([0.0, 1.5, 9.0]))["x"]
    np.testing.assert_allclose(found, [0.0, 0.2, 0.4])


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Step("x", np.nan), "size of the step is nan"),
        (lambda: Step("x", 1.0, rate=0.0), "rate of the step is 0"),
        (lambda: Sinusoid("x", "much", frequency=1.0), "amplitude is 'much'"),
        (lambda: RandomMotion("x", 1.0, corner=1.0, generator=7), "generator is int, expected numpy.random"),
        (lambda: Recorded([0.0, 0.0], {"x": [1.0, 2.0]}), "times of a recorded disturbance do not rise"),
        (lambda: Recorded([0.0, 1.0], {"x": [1.0, np.nan]}), r"x of a recorded disturbance has shape \(2,\)"),
    ],
)
def test_wrong_disturbance_is_one_clear_sentence(make, sentence):
    with pytest.raises(ftqp.InputError, match=sentence):
        make()


@pytest.mark.parametrize(("base", "name"), [(Platform(), "rotation"), (FreeBase(), "ry")])
def test_mean_twist_carries_every_pose_into_the_next(base, name):
    dt = 0.05
    motion = BaseMotion(base, [Sinusoid(name, 0.5, frequency=0.4), Step(name, 0.2, at=0.3, rate=1.0)], dt, 40)
    assert motion.pose.shape == (40, 4, 4) and motion.eta.shape == (40, len(base.coordinates))
    for k in range(39):
        turn = Rotation.from_rotvec(dt * motion.twist[k, 3:]).as_matrix()
        np.testing.assert_allclose(turn @ motion.pose[k, :3, :3], motion.pose[k + 1, :3, :3], atol=1e-12)
        moved = motion.pose[k, :3, 3] + dt * motion.twist[k, :3]
        np.testing.assert_allclose(moved, motion.pose[k + 1, :3, 3], atol=1e-14)


def test_unknown_coordinate_names_the_valid_ones():
    with pytest.raises(
        ftqp.InputError, match=r"'rol' is not a coordinate of the base.*; it has track, rotation, tilt"
    ):
        BaseMotion(Platform(), [Step("rol", 0.1)], 0.1, 2)


def test_sensor_is_late_by_whole_samples_and_begins_with_its_first():
    sensor = PoseSensor(late=2)
    seen = [sensor.measure(transform(np.eye(3), np.array([float(k), 0.0, 0.0])))[0, 3] for k in range(5)]
    assert seen == [0.0, 0.0, 0.0, 1.0, 2.0]
    sensor.reset()
    assert sensor.measure(transform(np.eye(3), np.array([9.0, 0.0, 0.0])))[0, 3] == 9.0


def test_noise_of_a_sensor_has_its_deviation_and_gives_rotations():
    sensor = PoseSensor(position=1e-3, rotation=2e-3, generator=np.random.default_rng(1))
    seen = np.array([sensor.measure(np.eye(4)) for _ in range(4000)])
    assert seen[:, :3, 3].std() == pytest.approx(1e-3, rel=0.03)
    assert Rotation.from_matrix(seen[:, :3, :3]).as_rotvec().std() == pytest.approx(2e-3, rel=0.03)


DT = 0.01
SWAY = (
    Sinusoid("x", 0.05, frequency=0.3, phase=-0.5 * np.pi),
    Sinusoid("rz", 0.08, frequency=0.4, phase=-0.5 * np.pi),
)


def simulate(robot, base, log=None, schedule=None, disturbances=SWAY, **options):
    planner = ftqp.Planner(robot, DT, level="velocity")
    world = MovingWorld(ftqp.InertialTask(planner, base), FreeBase(), disturbances, **options)
    path = ftqp.paths.Hold(world.start() @ robot.pose(robot.neutral), duration=3.0)
    run = ftqp.Simulation(planner, path, q=robot.neutral, world=world, log=log, schedule=schedule)
    return run.run(), world


SENSING = {
    "unknown": ftqp.MovingBase(),
    "observed": ftqp.MovingBase(observer=ftqp.Observer()),
    "known": ftqp.MovingBase(sensing="known"),
    "late": ftqp.MovingBase(sensing="late", delay=0.05),
}


@pytest.mark.parametrize(
    ("name", "worst"), [("unknown", 2e-3), ("observed", 3e-5), ("known", 1e-5), ("late", 5e-4)]
)
def test_tip_stays_in_space_however_the_base_is_measured(panda, tmp_path, name, worst):
    result, _ = simulate(panda, SENSING[name], tmp_path / "log.npy")
    found = summary(ftqp.load_log(tmp_path / "log.npy"))["inertial"]
    assert result.completed and 0.0 < found["max_position_error"] < worst
    assert found["status_counts"]["TRACKING"] > 290


def test_log_tells_true_pose_disturbance_error_and_status(panda, tmp_path):
    schedule = ftqp.Schedule([ftqp.FaultEvent(1.0, ftqp.Locked("panda_joint3"))])
    simulate(panda, SENSING["observed"], tmp_path / "log.npy", schedule)
    log = ftqp.load_log(tmp_path / "log.npy")
    t = log["t"]
    np.testing.assert_allclose(log["disturbance.x"], 0.05 * (1.0 - np.cos(2 * np.pi * 0.3 * t)), atol=1e-12)
    np.testing.assert_allclose(log["base"][:, :3], log["disturbance"][:, :3], atol=1e-15)
    np.testing.assert_allclose(
        log["target"][:, :3] - log["tip"][:, :3], log["inertial_error"][:, :3], atol=1e-12
    )
    assert log.units["disturbance.rz"] == "rad" and log.units["disturbance.x"] == "m"
    assert log["base_status"].max() == 0
    rest = log["q"][log["t"] > 1.5, 2]
    assert np.all(rest == rest[0])


def test_sensors_hide_the_truth_and_repeat_for_their_seed(panda):
    ends = [
        simulate(panda, SENSING["unknown"], position_noise=1e-3, rotation_noise=1e-3, seed=seed)[0].q
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(ends[0], ends[1])
    assert np.abs(ends[0] - ends[2]).max() > 1e-5
