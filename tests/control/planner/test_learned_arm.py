"""A torque arm learns what its model lacks, says so, and is the model again when that is asked."""

import logging

import numpy as np
import pinocchio
import pytest
from tests.ride import DT, START, Ride, circle
from tests.servo_arm import TorqueArm, Unheeding

import ftqp

PANDA = ftqp.robots.load("panda")


def geared(robot, q, rotors, **options):
    """The robot's true arm, with rotors beside the model's."""
    return TorqueArm(robot.with_rotors(robot.chain.armature + rotors), q, DT, **options)


def ridden(
    seconds=3.0,
    robot=PANDA,
    rotors=0.0,
    noise=0.0,
    events=None,
    inertia_error=None,
    stiffness=None,
    **options,
):
    drive = ftqp.Drive(kind="torque", inertia_error=inertia_error, stiffness=stiffness)
    planner = ftqp.Planner(robot, DT, drive=drive, noise=ftqp.Noise(q=noise))
    arm = geared(robot, START, rotors, sigma=noise, **options)
    return planner, Ride(robot, planner, arm, circle(robot, START), seconds, events)


def test_rotors_and_a_load_that_nobody_told_of_are_learned_on_the_way():
    planner, ride = ridden(rotors=0.1, mass=2.0, noise=1e-5, stiffness=80.0)
    found = planner.learned
    assert set(ride.status) == {"OK"}
    sure = found.rotors_error < 0.02
    assert sure.sum() >= 3
    np.testing.assert_allclose(found.rotors[sure], 0.1, atol=0.05)
    assert found.payload.mass == pytest.approx(2.0, rel=0.05)
    np.testing.assert_allclose(found.payload.com, [0.0, 0.0, 0.05], atol=0.06)


def test_an_arm_with_rotors_is_lost_without_and_kept_with_learning():
    _, without = ridden(rotors=0.1, inertia_error=0.0)
    assert "LAGGING" in without.status and without.error.max() > 0.05
    _, learning = ridden(rotors=0.1)
    assert set(learning.status) == {"OK"}


def test_the_arm_of_the_model_is_moved_as_if_nothing_were_learned():
    planner, learning = ridden()
    _, plain = ridden(inertia_error=0.0)
    assert set(learning.status) == set(plain.status) == {"OK"}
    assert planner.learned.payload is None
    np.testing.assert_allclose(planner.learned.rotors, 0.0, atol=2e-3)


def test_dry_friction_is_learned_joint_by_joint():
    planner, _ = ridden(seconds=4.0, rotors=0.05, friction=0.3)
    moved = planner.learned.rotors_error < 0.05
    assert moved.sum() >= 3
    np.testing.assert_allclose(planner.learned.friction[moved], 0.3, atol=0.15)


def test_an_arm_that_rests_keeps_what_it_knows_of_its_rotors():
    """Noise of the samples had let them fade to nothing within two seconds; a factor of two is enough."""
    planner, ride = ridden(seconds=8.0, rotors=0.1, noise=5e-5, friction=0.2, stiffness=80.0)
    assert set(ride.status) == {"OK"}
    assert planner.learned.rotors.min() > 0.05
    assert planner.learned.rotors.max() < 0.2


@pytest.mark.parametrize("late", [0, 4])
def test_samples_that_come_later_than_stated_are_known_to_from_how_the_arm_shakes(late):
    """A loop of 120 1/s has no room for 4 ms and shakes; a softer one need not, and then none is learned."""
    planner, ride = ridden(seconds=2.0, rotors=0.1, noise=1e-5, latency=late, stiffness=120.0)
    assert set(ride.status) == {"OK"}
    assert planner.learned.delay == pytest.approx(late * DT, abs=1.01 * DT)
    planner.reset(START)
    planner.step(START, None, ftqp.Target(pose=PANDA.pose(START)))
    assert planner.learned.delay == 0.0


def test_a_delay_that_is_stated_is_not_learned_again():
    drive = ftqp.Drive(kind="torque", latency=4 * DT)
    planner = ftqp.Planner(PANDA, DT, drive=drive, noise=ftqp.Noise(q=1e-5))
    arm = geared(PANDA, START, 0.1, mass=2.0, sigma=1e-5, latency=4)
    ride = Ride(PANDA, planner, arm, circle(PANDA, START), 2.0)
    assert set(ride.status) == {"OK"}
    assert planner.learned.delay <= 1.01 * DT


def test_a_load_that_is_told_takes_the_place_of_what_was_learned_and_rotors_stay():
    def told(planner, arm):
        planner.carry(ftqp.Payload(2.0, (0.0, 0.0, 0.05)))

    planner, ride = ridden(seconds=3.0, rotors=0.1, mass=2.0, events={1500: [told]})
    assert set(ride.status) == {"OK"}
    found = planner.learned
    assert found.payload is None or found.payload.mass < 0.2
    sure = found.rotors_error < 0.02
    np.testing.assert_allclose(found.rotors[sure], 0.1, atol=0.05)


def test_a_motor_that_has_lost_nearly_all_its_torque_leaves_numbers():
    def weaken(planner, arm):
        planner.report(ftqp.Degraded(6, torque=1e-12))

    planner, _ = ridden(seconds=1.5, rotors=0.05, events={700: [weaken]})
    assert np.isfinite(planner.learned.rotors).all() and np.isfinite(planner.learned.friction).all()


def test_friction_of_a_joint_that_swings_freely_is_learned_as_no_motor_moves_it():
    def let_go(planner, arm):
        arm.dead = 1
        planner.report(ftqp.FreeSwinging(1))

    planner = ftqp.Planner(PANDA, DT, drive="torque", noise=ftqp.Noise(q=1e-5))
    arm = Unheeding(PANDA, START, DT, friction=1.0, sigma=1e-5)
    Ride(PANDA, planner, arm, circle(PANDA, START), 1.4, {1000: [let_go]})
    assert planner.learned.friction[1] == pytest.approx(1.0, abs=0.3)


def test_what_was_learned_just_before_a_failure_is_taken_back():
    kept, seen = [], {}

    def note(planner, arm):
        kept.append(planner.learned.rotors.copy())

    def brake(planner, arm):
        arm.braked[2] = True

    def tell(planner, arm):
        seen["before"] = planner.learned.rotors.copy()
        planner.report(ftqp.Locked(2))

    def look(planner, arm):
        seen["after"] = planner.learned.rotors.copy()

    events = {k: [note] for k in range(990, 1440)} | {1590: [brake], 1600: [tell], 1602: [look]}
    _, ride = ridden(seconds=2.0, rotors=0.1, events=events)
    assert ride.status[-1] in ("OK", "RELAXED")
    assert not np.array_equal(seen["after"], seen["before"])
    assert any(np.array_equal(seen["after"], one) for one in kept)


@pytest.mark.parametrize("drive", ["position", "velocity"])
def test_other_drives_learn_nothing(drive):
    planner = ftqp.Planner(PANDA, DT, drive=drive)
    planner.reset(START)
    planner.step(START, None, ftqp.Target(pose=PANDA.pose(START)))
    assert planner.learned is None


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"kind": "torque", "inertia_error": -0.1}, "inertia_error"),
        ({"kind": "torque", "inertia_error": float("nan")}, "inertia_error"),
        ({"kind": "position", "inertia_error": 0.1}, "inertia_error is for drive 'torque'"),
    ],
)
def test_wrong_inertia_errors_are_refused_by_name(given, said):
    with pytest.raises(ftqp.InputError, match=said):
        ftqp.Drive(**given)


def test_with_rotors_puts_them_on_the_diagonal_of_M_and_takes_the_warning_back():
    q = PANDA.neutral
    M = PANDA.with_rotors([0.1] * 7).mass_matrix(q)
    np.testing.assert_allclose(M - PANDA.mass_matrix(q), 0.1 * np.eye(7), atol=1e-12)
    data = PANDA.with_rotors(0.2).model.createData()
    full = pinocchio.crba(PANDA.with_rotors(0.2).model, data, PANDA.configuration(q))
    assert full[6, 6] - PANDA.mass_matrix(q)[6, 6] == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("given", "error"),
    [
        (-0.1, ftqp.ModelError),
        (float("nan"), ftqp.FtqpError),
        ([0.1, 0.2], ftqp.InputError),
        (1e300, ftqp.ModelError),
    ],
)
def test_wrong_rotors_are_refused(given, error):
    with pytest.raises(error, match=r"rotor|inertia"):
        PANDA.with_rotors(given)


SENTENCE = "no rotor inertia"


def with_rotors(robot, inertia):
    model = robot.model.copy()
    model.armature = np.full(robot.nv, inertia)
    return ftqp.Robot.from_pinocchio(
        model, tip=robot.tip, limits=robot.limits, neutral=robot.neutral, name="geared"
    )


@pytest.fixture
def warned(caplog):
    def of(robot, **options):
        caplog.clear()
        with caplog.at_level(logging.WARNING, logger="ftqp"):
            planner = ftqp.Planner(robot, **options)
            for _ in range(2):
                planner.reset(robot.neutral)
        return [record.getMessage() for record in caplog.records if SENTENCE in record.getMessage()]

    return of


def test_torque_planner_says_once_that_the_model_has_no_rotors_and_where_they_go(warned):
    (said,) = warned(ftqp.robots.load("panda"), drive="torque")
    assert said.startswith("panda: ") and "armature in MJCF" in said and "drake:rotor_inertia" in said
