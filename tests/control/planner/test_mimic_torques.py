"""Joints that mimic others on an arm that takes torques, and beside a detector: their leaders move them."""

import numpy as np
import pytest
from tests.telescope import telescope

import ftqp

ROBOT = ftqp.Robot.from_urdf(telescope(), "tool").with_rotors(0.05)
CHAIN = ROBOT.chain
OWN = np.flatnonzero(CHAIN.lead == np.arange(ROBOT.nv))
LED = np.setdiff1d(np.arange(ROBOT.nv), OWN)
DT = 1e-3
NOISE = ftqp.Noise(q=1e-5, tau=0.1)


def coupled(q):
    return CHAIN.ratio * q[CHAIN.lead] + CHAIN.offset


START = coupled(np.array([0.3, 0.2, 0.0, 0.5, 0.0, 0.2, 0.9, 0.3]))


class TorqueArm:
    """What torques of its motors make of the arm, E'M E a + E'h = tau, and a joint that is held fast."""

    def __init__(self, truth=ROBOT):
        self.q, self.v, self.held, self._truth = START.copy(), np.zeros(ROBOT.nv), -1, truth
        self._noise = np.random.default_rng(3)

    def seen(self):
        return self.q + NOISE.q * self._noise.normal(size=ROBOT.nv)

    def move(self, tau, parts=2):
        free = OWN[self.held != OWN]
        for _ in range(parts):
            M, h = self._truth.mass_matrix(self.q), self._truth.bias(self.q, self.v)
            v = np.zeros(ROBOT.nv)
            v[free] = self.v[free] + DT / parts * np.linalg.solve(M[np.ix_(free, free)], (tau - h)[free])
            self.v = CHAIN.ratio * v[CHAIN.lead]
            self.q = coupled(self.q + DT / parts * v)


def followed(planner, arm, ticks=900, at=400, event=None):
    """The largest and the last distance of the true tip from a circle, and all torques."""
    path = ftqp.paths.Circle(ROBOT.pose(START), radius=0.06, duration=3.0)
    way = path.sample(DT * np.arange(ticks))
    targets = ftqp.Targets(way.pose, way.twist, way.acceleration)
    planner.reset(START)
    off, torques = [], []
    for k in range(ticks):
        if event is not None and k == at:
            event()
        step = planner.step(arm.seen(), None, targets.at(k))
        torques.append(step.tau.copy())
        arm.move(step.tau)
        off.append(float(np.linalg.norm(ROBOT.pose(arm.q)[:3, 3] - way.pose[k][:3, 3])))
    return max(off), off[-1], np.array(torques), step


def torque_planner(**more):
    return ftqp.Planner(ROBOT, DT, task=ftqp.Task("position"), drive="torque", noise=NOISE, **more)


def test_the_leaders_motor_carries_what_its_followers_move():
    planner = torque_planner()
    planner.reset(START)
    step = planner.step(START, None, ftqp.Target(pose=ROBOT.pose(START)))
    weight = ROBOT.bias(START, np.zeros(ROBOT.nv))
    assert step.tau[OWN] == pytest.approx(weight[OWN], rel=1e-9, abs=1e-9)
    assert (step.tau[LED] == 0.0).all()


@pytest.mark.parametrize("fault", [None, "shoulder", "lift"])
def test_the_tip_is_led_by_torques_and_goes_on_when_a_leader_locks(fault):
    planner, arm = torque_planner(), TorqueArm()

    def lock():
        arm.held = ROBOT.joint(fault)
        planner.report(ftqp.Locked(fault, mode="instant"))

    most, last, torques, _ = followed(planner, arm, event=lock if fault else None)
    assert last < 5e-4 and most < (1e-3 if fault is None else 2e-2)
    assert (torques[:, LED] == 0.0).all()
    assert (np.abs(torques[:, OWN]) <= ROBOT.limits.tau_max[OWN]).all()


def test_a_load_that_nobody_told_of_is_learned_through_the_leaders():
    heavier = ROBOT.with_payload(ftqp.Payload(mass=0.8))
    planner = torque_planner()
    _, last, _, _ = followed(planner, TorqueArm(heavier), ticks=1500)
    assert last < 5e-4
    assert planner._session.K.learned.load[0] == pytest.approx(0.8, abs=0.1)


@pytest.mark.parametrize("joint", ["lift", "shoulder"])
def test_a_detector_names_the_leader_whose_brake_has_closed(joint):
    planner, arm = torque_planner(detector=ftqp.Detector()), TorqueArm()
    _, last, _, _ = followed(planner, arm, event=lambda: setattr(arm, "held", ROBOT.joint(joint)))
    assert list(planner.faults) == [joint] and isinstance(planner.faults[joint], ftqp.Locked)
    assert last < 2e-2


def test_a_detector_of_a_healthy_arm_with_followers_names_none():
    planner = torque_planner(detector=ftqp.Detector())
    most, _, _, _ = followed(planner, TorqueArm(), ticks=1500)
    assert not planner.faults and most < 1e-3


def test_what_is_said_of_a_follower_is_said_of_its_leader():
    detector = ftqp.Detector(robot=ROBOT, dt=DT)
    detector.believe(ftqp.Locked("elbow"))
    assert detector._working().D.believed[ROBOT.joint("shoulder")] == 1
    detector.forget("elbow")
    D = detector._working().D
    assert D.believed[ROBOT.joint("shoulder")] == 0 and D.believed[ROBOT.joint("elbow")] == 1
