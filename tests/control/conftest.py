"""Arms and a start that the tests of the control layer share."""

import pytest

import ftqp


@pytest.fixture(scope="session")
def planar6():
    return ftqp.robots.load("planar6")


@pytest.fixture(scope="session")
def srs7():
    return ftqp.robots.load("srs7")


@pytest.fixture
def home(panda):
    """The pose of the Panda's tip at its neutral configuration."""
    return panda.pose(panda.neutral)
