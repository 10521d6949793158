"""A joint that gives way throws others, which are not named for it: what they show is that one's doing."""

import pytest

import ftqp
from ftqp.sim.sensors.joint_sensors import JointSensors

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')

from ftqp.sim.plants.joint_servo import JointServo
from ftqp.sim.plants.mujoco_plant import MujocoPlant
from ftqp.sim.plants.true_arm import TrueArm

PANDA = ftqp.robots.load("panda")
DT, AT, SECONDS, SIGMA = 1e-3, 2.0, 4.0, 1e-4
TRUE = TrueArm(payload=ftqp.Payload(1.5, com=(0.0, 0.0, 0.05)), coulomb=dict.fromkeys(PANDA.joints, 0.3))
"""A load and friction that nobody stated."""


def named(kind, *failures, **settings):
    """What the planner believes of which joint, after motors went off at (s, joint)."""
    servo = {} if kind == "torque" else {"bandwidth": 94.0}
    drive = ftqp.Drive(kind=kind, **servo)
    planner = ftqp.Planner(
        PANDA, DT, drive=drive, noise=ftqp.Noise(q=SIGMA), task=ftqp.Task(rows="position"), **settings
    )
    events = [ftqp.FaultEvent(at, ftqp.FreeSwinging(joint), "never") for at, joint in failures]
    ftqp.Simulation(
        planner,
        ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.08, duration=SECONDS),
        q=PANDA.neutral,
        plant=MujocoPlant(PANDA, DT, JointServo(PANDA, kind), TRUE),
        sensors=JointSensors(PANDA, DT, position_noise=SIGMA, seed=1),
        schedule=ftqp.Schedule(events),
    ).run()
    return {PANDA.joint(name) for name in planner.diagnosis.isolated}


@pytest.mark.parametrize("kind", ["position", "velocity", "torque"])
@pytest.mark.parametrize("joint", [1, 2, 3])
def test_only_the_joint_whose_motor_is_off_is_named(kind, joint):
    """Its fall, its impact at an end stop and its brake threw others, which a stop was to hold."""
    assert named(kind, (AT, joint)) == {joint}


@pytest.mark.parametrize("kind", ["velocity", "torque"])
def test_second_motor_that_goes_off_while_the_arm_goes_on_is_found_as_well(kind):
    assert named(kind, (AT, 5), (AT + 1.0, 3), emergency=None) == {3, 5}
