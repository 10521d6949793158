"""What faults, servos, friction and loads do to an arm in physics."""

from types import SimpleNamespace

import numpy as np
import pytest
from bench.wrapped_plant import WrappedPlant

from ftqp.control.paths import Circle
from ftqp.control.planner.planner import Planner
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Degraded, FreeSwinging, Locked
from ftqp.model import catalog
from ftqp.sim.loop import Simulation
from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.schedule import FaultEvent, Schedule
from ftqp.sim.sensors.joint_sensors import JointSensors

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')

from ftqp.sim.plants.joint_servo import JointServo
from ftqp.sim.plants.mujoco_plant import MujocoPlant
from ftqp.sim.plants.plant import Arm
from ftqp.sim.plants.true_arm import TrueArm

DT = 1e-3
START = np.array([0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398])
UNLIMITED = TrueArm(end_stops=10.0)
"""An arm whose end stops are too far to be met, as in the kinematic plant."""


def command(q, v=None, tau=None):
    zero = np.zeros(len(q))
    still = np.zeros(len(q), dtype=bool)
    return SimpleNamespace(q=q, v=zero if v is None else v, tau=zero if tau is None else tau, brakes=still)


def held(plant, q, seconds):
    """Where the arm is every tick while it is told to stay at q, (K, nv)."""
    told = command(q)
    places = []
    for _ in range(round(seconds / DT)):
        plant.advance(told)
        places.append(plant.q.copy())
    return np.array(places)


def worst_posture(robot, i):
    """A posture of about the largest static load of joint i."""
    rng, arm = np.random.default_rng(i), Arm(robot)
    low, high = np.maximum(robot.limits.q_min, -3.0), np.minimum(robot.limits.q_max, 3.0)
    postures = rng.uniform(low, high, (500, robot.nv))
    return postures[np.argmax([abs(arm.dynamics(q, np.zeros(robot.nv))[1][i]) for q in postures])]


def circle(panda, plant, events=(), seconds=3.0, drive="position", **settings):
    path = Circle(panda.pose(START), 0.1, axes=("x", "y"), duration=seconds)
    planner = Planner(panda, DT, drive=plant.drive or drive)
    schedule = Schedule(events)
    return Simulation(planner, path, q=START, plant=plant, schedule=schedule, log="memory", **settings).run()


def torque_arm(panda, true=None):
    return MujocoPlant(panda, DT, JointServo(panda, "torque"), true)


def test_servo_without_commanded_velocity_is_late_by_twice_its_time_constant(panda):
    servo = JointServo(panda, bandwidth=94.0, takes_velocity=False)
    plant = MujocoPlant(panda, DT, servo)
    plant.reset(START, np.zeros(7))
    speed, q = 0.2, START.copy()
    for _ in range(500):
        q[6] += speed * DT
        plant.advance(command(q, np.full(7, 5.0)))
    lag = 2.0 / 94.0
    assert lag - DT < (q[6] - plant.q[6]) / speed < lag  # a command is meant for the end of its tick


def test_velocity_servo_reaches_its_velocity_within_its_bandwidth(panda):
    plant = MujocoPlant(panda, DT, JointServo(panda, "velocity", bandwidth=94.0))
    plant.reset(START, np.zeros(7))
    v = np.zeros(7)
    v[6] = 0.3
    for _ in range(11):
        plant.advance(command(START, v))
    assert plant.v[6] == pytest.approx(0.3 * (1.0 - np.exp(-94.0 * 11 * DT)), rel=0.03)


@pytest.mark.parametrize("name", ["panda", "iiwa14", "xarm7"])
@pytest.mark.parametrize("mode", ["ramp", "instant"])
def test_no_brake_creeps_under_the_largest_load_of_its_joint(name, mode):
    robot = catalog.load(name)
    plant = MujocoPlant(robot, DT)
    for i in range(1, robot.nv, 2):
        q = worst_posture(robot, i)
        plant.reset(q, np.zeros(robot.nv))
        plant.fail(Locked(i, mode=mode))
        creep = abs(held(plant, q, 1.0)[-1, i] - q[i])
        assert creep < 0.1 * plant.tolerance


def test_brake_stops_a_moving_joint_within_milliseconds_and_holds_it(panda):
    plant = MujocoPlant(panda, DT)
    v = np.zeros(7)
    v[1] = 0.95
    plant.reset(START, v)
    plant.fail(Locked(1))
    places = held(plant, START, 1.0)[:, 1]
    assert 1e-3 < places[20] - START[1] < 6e-3
    assert np.ptp(places[20:]) < 1e-5


def test_brake_that_takes_its_time_lets_a_joint_that_fails_coast_until_it_has_closed(panda):
    plant = MujocoPlant(panda, DT, true=TrueArm(brake_delay=0.05))
    v = np.zeros(7)
    v[0] = 0.5
    plant.reset(START, v)
    plant.fail(Locked(0))
    places = held(plant, START, 0.3)[:, 0]
    assert places[48] - START[0] > 0.02  # it coasts with almost all of its speed
    assert np.ptp(places[70:]) < 1e-5
    plant.repair(0)
    assert np.ptp(held(plant, START, 0.2)[:, 0]) > 1e-3


def test_joint_that_is_to_be_braked_is_driven_until_its_brake_has_closed(panda):
    plant = MujocoPlant(panda, DT, true=TrueArm(brake_delay=0.05))
    plant.reset(START, np.zeros(7))
    told = command(START)
    told.brakes = np.arange(7) == 1
    torques = []
    for _ in range(100):
        plant.advance(told)
        torques.append(plant.tau[1])
    assert np.abs(torques[:48]).min() > 1.0 and np.abs(torques[52:]).max() == 0.0
    assert abs(plant.q[1] - START[1]) < 1e-4


def test_commands_that_come_late_at_random_do_the_same_with_the_same_seed_after_a_reset(panda):
    def run(plant):
        plant.reset(START, np.zeros(7))
        q, places = START.copy(), []
        for _ in range(40):
            q[6] += 2e-4
            plant.advance(command(q, np.full(7, 0.2)))
            places.append(plant.q[6])
        return np.array(places)

    on_time = run(MujocoPlant(panda, DT))
    late = MujocoPlant(panda, DT, true=TrueArm(jitter=0.9), seed=3)
    first = run(late)
    np.testing.assert_array_equal(first, run(late))
    assert (run(MujocoPlant(panda, DT, true=TrueArm(jitter=0.9), seed=4)) != first).any()
    assert (first <= on_time).all() and 0.0 < (on_time - first).max() < 2e-4


def test_slipping_brake_lets_its_joint_creep(panda):
    q = worst_posture(panda, 1)
    load = abs(Arm(panda).dynamics(q, np.zeros(7))[1][1])
    for holds, slips in ((1.1 * load, False), (0.9 * load, True)):
        plant = MujocoPlant(panda, DT, true=TrueArm(brake={"panda_joint2": holds}))
        plant.reset(q, np.zeros(7))
        plant.fail(Locked(1))
        assert (abs(held(plant, q, 0.3)[-1, 1] - q[1]) > 0.02) == slips


def test_sticking_joint_stays_under_a_torque_below_its_dry_friction(panda):
    plant = MujocoPlant(panda, DT, JointServo(panda, "torque"), TrueArm(coulomb={"panda_joint7": 1.0}))
    plant.reset(START, np.zeros(7))
    gravity = Arm(panda).dynamics(START, np.zeros(7))[1].copy()
    for extra, moves in ((0.9, False), (1.1, True)):
        tau = gravity.copy()
        tau[6] += extra
        for _ in range(50):
            plant.advance(command(START, tau=tau))
        assert (abs(plant.v[6]) > 0.05) == moves


def test_free_joint_with_friction_loses_its_speed_as_its_damping_says(panda):
    plant = MujocoPlant(panda, DT, JointServo(panda, "torque"))
    v = np.zeros(7)
    v[0] = 1.0
    plant.reset(START, v)
    plant.fail(FreeSwinging(0, damping=2.0))
    arm = Arm(panda)
    for i in range(1, 7):
        plant.fail(Locked(i))
    M = arm.dynamics(START, np.zeros(7))[0][0, 0]
    held(plant, START, 0.3)
    assert plant.v[0] == pytest.approx(np.exp(-2.0 / M * 0.3), rel=0.02)


def test_degraded_joint_has_what_is_left_of_torque_and_range(panda):
    plant = torque_arm(panda)
    plant.reset(START, np.zeros(7))
    plant.fail(Degraded(6, torque=0.5, q_max=0.8))
    for _ in range(300):
        plant.advance(command(START, tau=np.full(7, 100.0)))
    assert plant.tau[6] == pytest.approx(0.5 * panda.limits.tau_max[6])
    assert plant.q[6] < 0.81


def test_end_stops_lie_a_little_beyond_the_limits_and_can_be_put_at_them(panda):
    for true, low, high in ((TrueArm(), 0.04, 0.06), (TrueArm(end_stops=0.0), -0.001, 0.01)):
        plant = torque_arm(panda, true)
        plant.reset(START, np.zeros(7))
        for _ in range(400):
            tau = np.zeros(7)
            tau[6] = 5.0
            plant.advance(command(START, tau=tau))
        assert low < plant.q[6] - panda.limits.q_max[6] < high


def test_repaired_arm_is_healthy_after_a_reset(panda):
    plant = MujocoPlant(panda, DT)
    plant.reset(START, np.zeros(7))
    fresh = held(plant, START + 0.01, 0.1)
    for fault in (Locked(1, mode="instant"), Locked(2), FreeSwinging(3), Degraded(4, torque=0.1)):
        plant.fail(fault)
    held(plant, START + 0.01, 0.1)
    plant.reset(START, np.zeros(7))
    np.testing.assert_allclose(held(plant, START + 0.01, 0.1), fresh, atol=1e-12)


def beside(robot):
    """Sensors that show an arm beside its command, so that some of the speed limits is left to its servos."""
    return JointSensors(robot, DT, bias=2e-6)


@pytest.mark.long
@pytest.mark.parametrize(
    ("fault", "until"), [(FreeSwinging(0), 3.0), (FreeSwinging(2), 1.7), (FreeSwinging(4), 1.85)]
)
def test_both_plants_agree_on_a_free_joint(panda, fault, until):
    """Both are led as an arm with torque drives, whose free joint swings from the first tick."""
    events, plant = [FaultEvent(1.5, fault)], KinematicPlant(panda, DT)
    one = circle(panda, plant, events, duration=until, drive="torque", sensors=beside(panda))
    other = circle(panda, torque_arm(panda, UNLIMITED), events, duration=until)
    assert (one.log["status"] != other.log["status"]).sum() <= 2
    error, expected = other.log["position_error"], one.log["position_error"]
    assert np.abs(error - expected).max() < max(0.01 * expected.max(), 1e-4)


@pytest.mark.long
def test_both_plants_agree_on_a_joint_that_locks_at_once(panda):
    """When no joint is near its speed limit, of which an arm whose servos are estimated leaves them some."""
    events = [FaultEvent(1.6, Locked(2, mode="instant", reset="momentum"))]
    one = circle(panda, KinematicPlant(panda, DT), events, sensors=beside(panda))
    other = circle(panda, torque_arm(panda), events)
    assert one.completed and other.completed
    expected = one.log["position_error"].max()
    assert other.log["position_error"].max() == pytest.approx(expected, rel=1e-3)
    np.testing.assert_allclose(other.q, one.q, atol=1e-3)


class Poisoned(WrappedPlant):
    """A torque arm whose sixth motor is asked for what is not a number in tick 100."""

    def __init__(self, plant):
        super().__init__(plant)
        self._ticks = 0

    def advance(self, step):
        tau = step.tau.copy()
        tau[5] = np.nan if self._ticks == 100 else tau[5]
        self._ticks += 1
        self._plant.advance(command(step.q, step.v, tau))


def test_run_ends_with_a_sentence_when_the_physics_breaks_down(panda):
    result = circle(panda, Poisoned(torque_arm(panda)))
    assert result.steps == 101
    assert not result.completed
    assert "panda_joint6" in result.broken
    assert result.log.metadata["state"] == "broken"


def test_robot_without_inertia_is_refused():
    with pytest.raises(InputError, match=r"puma560 has no inertia.*take plant 'kinematic'"):
        MujocoPlant(catalog.load("puma560"), DT)


@pytest.mark.parametrize(
    ("takes", "made_for", "words"),
    [("torque", "position", "plant takes torques"), ("position", "torque", "plant takes positions"),
     ("velocity", "position", "plant takes velocities")],
)  # fmt: skip
def test_arm_that_takes_something_else_than_its_planner_sends_is_refused(panda, takes, made_for, words):
    path = Circle(panda.pose(START), 0.1, duration=1.0)
    with pytest.raises(InputError, match=rf"{words}, but .*drive='{takes}'"):
        Simulation(
            Planner(panda, DT, drive=made_for),
            path,
            q=START,
            plant=MujocoPlant(panda, DT, JointServo(panda, takes)),
        )


def test_arm_of_another_period_or_of_another_type_is_refused(panda):
    path = Circle(panda.pose(START), 0.1, duration=1.0)
    for plant, says in (
        (
            MujocoPlant(panda, 2.0 * DT),
            "a command every .* s, but the planner .* the same dt",
        ),
        ("mujoco", "plant is 'mujoco', expected a plant"),
    ):
        with pytest.raises(InputError, match=says):
            Simulation(Planner(panda, DT), path, q=START, plant=plant)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda r: MujocoPlant(r, DT, substeps=0), "substeps is 0, expected a whole number from 1"),
        (lambda r: JointServo(r, "force"), "'force' is not a drive of an arm"),
        (lambda r: JointServo(r, "torque", takes_velocity=False), "is for drive 'position'"),
        (lambda r: MujocoPlant(r, DT, true=TrueArm(coulomb={"j9": 1.0})), "'j9' is not a joint of panda"),
        (lambda r: MujocoPlant(r, DT, true=TrueArm(viscous="much")), "viscous is 'much'"),
        (
            lambda r: MujocoPlant(r, DT, true=TrueArm(brake={"panda_joint1": 0.0})),
            "brake of panda_joint1 is 0",
        ),
    ],
)
def test_wrong_values_are_refused_with_a_sentence(panda, make, message):
    with pytest.raises(InputError, match=message):
        make(panda)


def servo_torques(robot, drive, q, limit):
    """Of a servo that is told to go to q and to stand, at START at rest."""
    servo, tau, zero = JointServo(robot, drive), np.zeros(robot.nv), np.zeros(robot.nv)
    servo.take(command(q, v=q - START))
    servo.torques(START, zero, limit, tau)
    return tau


def test_motor_at_its_limit_leaves_the_others_the_motion_they_are_asked_for(panda):
    limit, away = panda.limits.tau_max.copy(), START.copy()
    away[1] += 0.05
    tau = servo_torques(panda, "position", away, limit)
    M, h = Arm(panda).dynamics(START, np.zeros(panda.nv))
    a = np.linalg.solve(M, tau - h)
    assert abs(tau[1]) == limit[1]
    wanted = 94.0**2 * (away - START) + 2.0 * 94.0 * (away - START)
    others = np.arange(panda.nv) != 1
    np.testing.assert_allclose(a[others], wanted[others], atol=1e-9)
    assert 0.0 < a[1] < 0.9 * wanted[1]


@pytest.mark.parametrize("drive", ["position", "velocity"])
def test_brake_that_is_asked_for_closes_whatever_the_arm_takes(panda, drive):
    plant = MujocoPlant(panda, DT, JointServo(panda, drive))
    plant.reset(START, np.zeros(panda.nv))
    told = command(START + 0.2, v=np.full(panda.nv, 0.2))
    told.brakes[3] = True
    for _ in range(200):
        plant.advance(told)
    assert abs(plant.q[3] - START[3]) < 1e-4
    assert plant.tau[3] == 0.0
    assert abs(plant.q[0] - START[0]) > 0.01
