"""A torque at one joint moves every joint; the joint is found by the direction of that motion."""

import numpy as np
import pytest
from tests.shaken import DT, SIGMA, Shaken, watch

import ftqp

AT = 400


@pytest.mark.parametrize("name", ["panda", "iiwa14"])
@pytest.mark.parametrize("joint", range(7))
def test_joint_is_found_though_others_move_more(name, joint):
    robot = ftqp.robots.load(name)
    motion = Shaken(robot, AT + 25, speed=0.3, seed=joint)
    detector = ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=SIGMA))
    q = motion.q
    along = np.linalg.inv(robot.mass_matrix(motion.true[AT]))[:, joint]
    t = DT * np.arange(25)
    q[AT:] += np.outer(0.5 * t * t, 200.0 * along / np.abs(along).max())
    diagnosis = watch(detector, motion, q)
    assert diagnosis.suspect == robot.joints[joint]
