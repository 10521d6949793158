"""A torque arm whose rotors its model lacks is warned of, and learns them unless it is told not to."""

import logging

import numpy as np
import pytest

import ftqp

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


def test_joints_whose_rotors_alone_are_missing_are_named(warned):
    (said,) = warned(with_rotors(ftqp.robots.load("panda"), [0.05] * 5 + [0.0] * 2), drive="torque")
    assert "no rotor inertia of panda_joint6, panda_joint7 is in the model" in said


@pytest.mark.parametrize("drive", ["position", "velocity"])
def test_arms_that_take_no_torques_need_no_rotors(warned, drive):
    assert not warned(ftqp.robots.load("panda"), drive=drive)


def test_arm_with_rotors_is_not_warned_of(warned):
    assert not warned(ftqp.robots.load("xarm7"), drive="torque")
    assert not warned(with_rotors(ftqp.robots.load("panda"), 0.05), drive="torque")


@pytest.mark.long
@pytest.mark.parametrize(
    ("inertia", "known", "error", "kept"),
    [(0.02, False, 0.0, True), (0.05, False, 0.0, False), (0.05, True, 0.0, True), (0.3, False, None, True)],
)
def test_healthy_torque_arm_keeps_its_path_if_its_rotors_are_small_known_or_learned(
    inertia, known, error, kept
):
    pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    panda = ftqp.robots.load("panda")
    true = with_rotors(panda, inertia)
    noise = ftqp.Noise(q=1e-4)
    drive = ftqp.Drive(kind="torque", inertia_error=error)
    planner = ftqp.Planner(true if known else panda, 1e-3, drive=drive, noise=noise)
    plant = ftqp.MujocoPlant(true, 1e-3, ftqp.JointServo(panda, "torque"), substeps=2)
    start = panda.pose(panda.neutral)
    path = ftqp.paths.Circle(start, 0.1, duration=6.0, axes=((0, 1, 0), (0, 0, 1)))
    log = ftqp.Simulation(planner, path, q=panda.neutral, plant=plant, log="memory").run().log
    stopped = (log["status"] == list(ftqp.StepStatus).index(ftqp.StepStatus.STOPPED)).any()
    assert stopped != kept
    if kept:
        assert log["position_error"].max() < 1e-3
