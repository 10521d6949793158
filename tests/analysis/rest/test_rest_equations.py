"""The equations of a rest: their derivative, and what solves them."""

import numpy as np
import pytest
from planar_arms import links

from ftqp.analysis.goals import goal_study
from ftqp.analysis.rest.linearisation import rest_test
from ftqp.analysis.rest.rest_tracing import RestEquations
from ftqp.model import catalog


@pytest.mark.parametrize("name", ["planar", "panda"])
def test_derivative_is_that_of_central_differences(name: str) -> None:
    robot = links(1, 1, 1, 1) if name == "planar" else catalog.load("panda")
    rng = np.random.default_rng(1)
    study = goal_study(robot, robot.pose(robot.neutral), "pose")
    B = rng.normal(size=(robot.nv, robot.nv))
    equations = RestEquations(study, B @ B.T + np.eye(robot.nv), 2)
    z = equations.started(robot.neutral + rng.uniform(-0.3, 0.3, (1, robot.nv)))
    z = z + rng.normal(scale=0.1, size=z.shape)
    d = equations.values(z)[1][0]
    step = 1e-6
    pairs = [
        (equations.values(z + step * h)[0], equations.values(z - step * h)[0]) for h in np.eye(equations.size)
    ]
    rates = np.column_stack([(up - down)[0] / (2.0 * step) for up, down in pairs])
    assert d == pytest.approx(rates, abs=1e-8)


def test_solutions_are_rests_for_any_weights() -> None:
    robot = links(1, 0.7, 1.2, 0.5)
    rng = np.random.default_rng(2)
    B = rng.normal(size=(4, 4))
    W = B @ B.T + np.eye(4)
    study = goal_study(robot, (1.0, 0.5), "position")
    equations = RestEquations(study, np.linalg.inv(W), 1)
    z, done = equations.solved(equations.started(study.starts(128)), held=False)
    assert done.mean() > 0.5
    for q in z[done & (np.abs(z[:, -1]) > 1e-3) & (np.abs(z[:, -3]) > 1e-3)][:, :4]:
        assert rest_test(robot, q, ["j2"], (1.0, 0.5), W).rest < 1e-7
