"""A motion of the joints as the objective of a QP, and the tip's target that goes with it."""

import numpy as np
import pytest

import ftqp
from ftqp.kernel.entry.session import JointsMemory

PANDA = ftqp.robots.load("panda")


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_step_is_as_near_to_the_demand_as_its_box_allows(level):
    """d = x_r + kv (v_r - v) + kp (q_r - q), each joint cut to its interval."""
    rng = np.random.default_rng(1)
    planner = ftqp.Planner(PANDA, 1e-3, level=level, torque_limits=False)
    memory = JointsMemory()
    joints = memory.joints
    lead = planner.lead(memory)
    joints.kp, joints.kv = 100.0, 20.0
    for _ in range(20):
        q, v = PANDA.neutral + rng.uniform(-0.1, 0.1, 7), rng.uniform(-0.3, 0.3, 7)
        joints.q[:7], joints.v[:7] = q + rng.uniform(-0.01, 0.01, 7), v + rng.uniform(-0.1, 0.1, 7)
        joints.x[:7] = rng.uniform(-4.0, 4.0, 7)
        planner.reset(q, v)
        step = lead.step(q, v, (), None, None)
        demand = joints.x[:7] + 20.0 * (joints.v[:7] - v) + 100.0 * (joints.q[:7] - q)
        assert np.abs(joints.demand[:7] - demand).max() < 1e-12
        x = step.a if level == "acceleration" else step.v
        assert np.abs(x - np.clip(demand, step.lower, step.upper)).max() < 1e-9
        cut = np.abs(demand - np.clip(demand, step.lower, step.upper)).max() > 1.0
        assert (step.status is ftqp.StepStatus.RELAXED) or not cut


def test_error_of_the_tip_is_to_where_the_motion_of_the_working_joints_puts_it():
    planner = ftqp.Planner(PANDA)
    planner.report(ftqp.Locked(3, mode="instant"))
    memory = JointsMemory()
    lead = planner.lead(memory)
    q = PANDA.neutral
    ahead = q + np.linspace(-0.01, 0.01, 7)
    planner.reset(q)
    memory.joints.q[:7] = ahead
    step = lead.step(q, np.zeros(7), (), None, None)
    ahead[3] = q[3]
    shift = PANDA.pose(ahead)[:3, 3] - PANDA.pose(q)[:3, 3]
    assert np.abs(step.task_error[:3] - shift).max() < 1e-12
