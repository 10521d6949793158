"""An arm that does what is asked of it, and its detector."""

import pytest
from tests.shaken import DT, SIGMA

import ftqp


@pytest.fixture(scope="session")
def robot():
    return ftqp.robots.load("panda")


@pytest.fixture
def detector(robot):
    return ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=SIGMA))
