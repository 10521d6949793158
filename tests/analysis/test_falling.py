"""The energy of a fall, against the potential energy that pinocchio knows."""

import numpy as np
import pinocchio as pin
import pytest

import ftqp
from ftqp.core.errors import InputError

POSTURE = [0.3, 0.6, 0.2, -1.2, 0.3, 1.6, 0.4]


@pytest.mark.parametrize("name", ["panda", "iiwa14", "xarm7"])
def test_energy_is_the_potential_energy_lost_on_the_way_to_the_stop(name):
    robot = ftqp.robots.load(name)
    q = robot.neutral + np.linspace(0.1, 0.4, 7)
    data = robot.model.createData()
    fell = 0
    for i, energy in enumerate(ftqp.analysis.fall_energy(robot, q).values()):
        ends = []
        for stop in (robot.limits.q_min[i], robot.limits.q_max[i]):
            way = np.linspace(q[i], stop, 400)
            lost = []
            for angle in way:
                moved = q.copy()
                moved[i] = angle
                lost.append(pin.computePotentialEnergy(robot.model, data, moved))
            gained = lost[0] - np.array(lost[1:])
            ends.append(gained[-1] if (gained > 0.0).all() else 0.0)
        assert energy == pytest.approx(max(ends), abs=0.02 * max(1.0, max(ends)))
        fell += energy > 1.0
    assert fell >= 1


def test_joint_without_gravity_has_no_energy_to_lose():
    assert ftqp.analysis.fall_energy(ftqp.robots.load("panda"), POSTURE)["panda_joint1"] == 0.0


def test_shoulder_falls_harder_than_wrist():
    energy = ftqp.analysis.fall_energy(ftqp.robots.load("panda"), POSTURE)
    assert energy["panda_joint2"] > 10.0 > energy["panda_joint6"]


def test_robot_without_masses_is_refused():
    with pytest.raises(InputError, match="has no inertia, so no joint falls"):
        ftqp.analysis.fall_energy(ftqp.robots.load("srs7"), np.zeros(7))
