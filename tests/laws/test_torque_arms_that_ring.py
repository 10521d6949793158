"""Torque arms whose gears give way, or whose encoders are coarse: no joint is accused of what a loop does."""

import numpy as np
import pinocchio
import pytest
from tests.ride import DT, START, Ride, circle
from tests.servo_arm import TorqueArm

import ftqp

PANDA = ftqp.robots.load("panda")
MASS = np.diag(PANDA.mass_matrix(START))


class ElasticArm(TorqueArm):
    """Motors with encoders behind gears that give way, of this resonance where the motor is held."""

    def __init__(self, resonance, rotor, **options):
        super().__init__(PANDA, START, DT, **options)
        self.rotor, self.spring = rotor * MASS, MASS * resonance**2
        self.damper = 0.1 * MASS * resonance
        self.motor, self.turns = self.q + PANDA.bias(self.q, self.v) / self.spring, self.v.copy()
        self.held = False

    def measured(self):
        return self.motor + self.sigma * self.rng.normal(size=len(self.q))

    def command(self, step):
        h = self.dt / 8
        for _ in range(0 if self.held else 8):
            given = self.spring * (self.motor - self.q) + self.damper * (self.turns - self.v)
            a = pinocchio.aba(self.model, self.data, self.q, self.v, given)
            self.turns = self.turns + h * (step.tau - given) / self.rotor
            self.motor = self.motor + h * self.turns
            self.advance(a, h)
        if self.held:
            self.v, self.turns = np.zeros(7), np.zeros(7)


def ridden(arm, events=None, step=0.0, robot=PANDA):
    """The planner, the ride, and the fastest joint as a share of its limit."""
    planner, speeds = ftqp.Planner(robot, DT, drive="torque"), []

    def seen(k, q):
        speeds.append(np.max(np.abs(arm.v) / robot.limits.v_max))
        return np.round(q / step) * step + 1e-5 * arm.rng.standard_normal(7) if step else q

    return planner, Ride(PANDA, planner, arm, circle(PANDA, START), 6.0, events, seen), max(speeds)


@pytest.mark.parametrize(("resonance", "rotor"), [(95.0, 0.5), (120.0, 0.15), (150.0, 0.15)])
def test_arm_with_elastic_gears_goes_round_and_no_joint_is_accused(resonance, rotor):
    """They took the swinging for samples that came late, or for encoders that had jumped."""
    planner, ride, fastest = ridden(ElasticArm(resonance, rotor, sigma=2e-5))
    assert planner.stopped_because is None and not planner.findings
    assert fastest < 1.0 and ride.after(5.0) < 3e-3
    assert planner.learned.delay == 0.0


@pytest.mark.parametrize("step", [1.5e-3, 2.5e-3])
def test_step_of_a_coarse_encoder_is_believed_though_fine_noise_hides_it(step):
    """One tick at the speed limit is less than a step: each was refused, and no loop holds an arm so."""
    slow = PANDA.with_limits(v_max=np.full(7, 0.5))
    arm = TorqueArm(PANDA.with_rotors(PANDA.chain.armature + 0.05), START, DT)
    planner, ride, fastest = ridden(arm, step=step, robot=slow)
    assert planner.stopped_because is None and not planner.findings
    assert fastest < 1.05 and ride.off_path.max() < 3e-3


def test_what_brakes_hold_is_not_learned_as_friction():
    """A joint without friction had 3 N m in a hold, and leapt after the next one."""
    arm = TorqueArm(PANDA.with_rotors(PANDA.chain.armature + 0.05), START, DT)
    felt = []

    def hold(on):
        return [lambda planner, arm: arm.braked.__setitem__(slice(None), on)]

    def feel(planner, arm):
        felt.append(np.max(planner.learned.friction / PANDA.limits.tau_max))

    events = {400: hold(True), 750: [feel], 800: hold(False), 1400: hold(True), 1700: hold(False)}
    planner, ride, fastest = ridden(arm, events)
    assert ride.status[749] == "HELD" and felt[0] < 0.01
    assert planner.stopped_because is None and not planner.findings
    assert fastest < 1.0 and ride.off_path[-1] < 1e-3
