"""Where simulated arms come to rest off their goal is where the equations of a rest say."""

import numpy as np
import pytest
from planar_arms import links

from ftqp.analysis import outcome, reachable_after, rest_configurations, rest_curves
from ftqp.analysis.rest.linearisation import RestKind

W = np.array([[1.0, 0.4, 0.0], [0.4, 1.5, -0.5], [0.0, -0.5, 0.8]])


@pytest.mark.parametrize("weights", [pytest.param(None, marks=pytest.mark.slow), W])
def test_simulated_arm_rests_off_its_goal_at_a_known_sink(weights: np.ndarray | None) -> None:
    robot, goal = links(1, 1, 0.7), (1.2, 0.9)
    rng = np.random.default_rng(3)
    sinks = {joint: rest_curves(robot, goal, joint, weights).sink_intervals() for joint in robot.joints}
    stopped = 0
    for _ in range(24):
        q, joint = rng.uniform(-np.pi, np.pi, 3), robot.joints[int(rng.integers(3))]
        value = float(q[robot.joint(joint)])
        found = outcome(robot, goal, q, locked=[joint], W=weights)
        if found.kind == "correct":
            assert reachable_after(robot, goal, {joint: value})
        if found.kind != "erroneous":
            continue
        rests = rest_configurations(robot, goal, joint, value, weights)
        ends = np.array([rest.q for rest in rests if rest.kind is RestKind.SINK])
        away = (ends - found.q + np.pi) % (2.0 * np.pi) - np.pi
        assert np.abs(away).max(axis=1).min() < 1e-5
        assert sinks[joint].contains(value)
        stopped += 1
    assert stopped > 4
