"""Arms and a start that the tests of the control layer share."""

import numpy as np
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


@pytest.fixture
def follow():
    """Closed loop: the planner's own commands are the next state; yields each step."""

    def loop(planner, target, ticks, q=None, v=None, events=None, reset=True):
        n = planner.robot.nv
        q = planner.robot.neutral.copy() if q is None else np.array(q, dtype=float)
        v = np.zeros(n) if v is None else np.array(v, dtype=float)
        if reset:
            planner.reset(q, v)
        for k in range(ticks):
            if events and k in events:
                events[k](planner)
            step = planner.step(q, v, target(k) if callable(target) else target)
            yield step
            q, v = step.q.copy(), step.v.copy()

    return loop
