"""Rests for one locked value against closed forms."""

import numpy as np
import pytest
from planar_arms import links

from ftqp.analysis.rest.linearisation import RestKind, rest_test
from ftqp.analysis.rest.rest_configurations import rest_configurations
from ftqp.core.errors import InputError
from ftqp.model import catalog


def closed_form(lengths: tuple[float, float, float], x: tuple[float, float], joint: int, value: float) -> int:
    """How many rests three links have for a locked value: roots of A cos(phi - b) = C for both foldings."""
    l1, l2, l3 = lengths
    goal = complex(*x)
    count = 0
    for s in (1.0, -1.0):
        if joint == 0:
            o, d = l1 * np.exp(1j * value), l2 + s * l3
            amplitude = abs(d * (goal - 2.0 * o))
            constant = abs(o) ** 2 + d * d - (np.conj(o) * goal).real
        elif joint == 1:
            z = l1 + l2 * np.exp(1j * value)
            d, delta = abs(z) + s * l3, np.angle(z)
            amplitude = abs(goal) * abs(d - l1 * np.exp(-1j * delta))
            constant = d * d - d * l1 * np.cos(delta)
        else:
            z = l2 + l3 * np.exp(1j * value)
            d = l1 + s * abs(z)
            kappa = (0.0 if s > 0 else np.pi) - np.angle(z) + value
            amplitude, constant = abs(goal), d * np.cos(kappa)
        count += 2 if abs(constant) < amplitude else 0
    return count


@pytest.mark.parametrize("joint", range(3))
def test_grid_finds_all_rests_of_the_closed_form(joint: int) -> None:
    lengths, x = (1.0, 0.8, 0.55), (1.1, 0.6)
    robot = links(*lengths)
    total = 0
    for value in np.linspace(-3.1, 3.1, 20):
        found = rest_configurations(robot, x, joint, float(value))
        assert len(found) == closed_form(lengths, x, joint, float(value))
        total += len(found)
    assert total > 20


def test_rests_outside_joint_limits_are_left_out() -> None:
    free, limited = links(1, 1, 1), catalog.load("planar", lengths=(1, 1, 1))
    value = np.deg2rad(45.0)
    assert len(rest_configurations(free, (1.5, 1.5), "j2", value)) == 2
    assert rest_configurations(limited, (1.5, 1.5), "j2", value) == []  # they need joint 3 at 157.5 degrees


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"joint": "j4"}, "is not a joint"),
        ({"value": np.inf}, "expected a finite position"),
        ({"W": -np.eye(3)}, "expected a positive definite matrix"),
        ({"W": np.ones((2, 2))}, "W has shape"),
        ({"rows": ("x", "y", "rz"), "goal": np.eye(4)}, "expected at least one joint more than rows"),
    ],
)
def test_silly_input_is_refused(arguments: dict[str, object], sentence: str) -> None:
    given = {"goal": (1.0, 1.0), "joint": "j1", "value": 0.0, **arguments}
    with pytest.raises(InputError, match=sentence):
        rest_configurations(links(1, 1, 1), **given)  # type: ignore[arg-type]


def test_joint_that_never_moves_the_tip_is_left_out() -> None:
    robot = catalog.load("panda").with_limits(q_min=-np.inf, q_max=np.inf)
    goal = (0.5, 0.1, 0.4)
    found = rest_configurations(robot, goal, "panda_joint2", 0.5)
    assert len(found) > 20
    for rest in found:
        assert rest.q[6] == pytest.approx(robot.neutral[6], abs=1e-12)
        assert len(rest.eigenvalues) == 5
        assert rest_test(robot, rest.q, "panda_joint2", goal).passes()
    assert {rest.kind for rest in found} <= {RestKind.SINK, RestKind.SADDLE, RestKind.SOURCE}
    assert rest_configurations(robot, goal, "panda_joint7", 0.5) == []
