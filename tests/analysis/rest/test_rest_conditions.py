"""The conditions of a rest against the command itself."""

import numpy as np
import pytest
from planar_arms import links

from ftqp.analysis.rest.linearisation import rest_test
from ftqp.analysis.rest.rest_configurations import rest_configurations
from ftqp.core.errors import InputError
from ftqp.model import catalog


def test_one_lock_rests_just_where_error_and_rank_say_so() -> None:
    robot = links(1, 0.8, 0.6)
    rng = np.random.default_rng(4)
    for _ in range(20):
        B = rng.normal(size=(3, 3))
        W = B @ B.T + 0.3 * np.eye(3)
        goal = rng.uniform(-1.5, 1.5, 2)
        joint = int(rng.integers(3))
        for rest in rest_configurations(robot, goal, joint, float(rng.uniform(-3.0, 3.0)), W):
            found = rest_test(robot, rest.q, [joint], goal, W)
            assert found.passes()
            assert max(found.collinear, found.rank) < 1e-8
        found = rest_test(robot, rng.uniform(-3.0, 3.0, 3), [joint], goal, W)
        assert not found.passes()
        assert max(found.collinear, found.rank) > 1e-6


def test_several_locks_need_more_than_a_loss_of_rank() -> None:
    robot = links(1, 1, 1, 1)
    q = np.array([0.3, 0.5, 0.7, 0.0])
    x = robot.pose(q)[:2, 3]
    J = robot.jacobian(q)[:2]
    healthy = J[:, 2:]
    assert np.linalg.matrix_rank(healthy, tol=1e-9) == 1  # joints 3 and 4 in line with the tip
    left = np.linalg.svd(healthy)[0][:, 1]  # no healthy joint moves the tip along it
    resting = rest_test(robot, q, ["j1", "j2"], x + J[:, :2] @ (J[:, :2].T @ left))
    assert resting.rest < 1e-12
    other = rest_test(robot, q, ["j1", "j2"], x + 0.3 * J[:, 0])
    assert other.rank < 1e-12
    assert other.collinear < 1e-12
    assert other.rest > 1e-2


def test_pose_of_a_panda_rests_where_the_search_says() -> None:
    robot = catalog.load("panda")
    goal = robot.pose(robot.neutral)
    found = rest_configurations(robot, goal, "panda_joint2", 0.5, rows="pose")
    assert found
    for rest in found:
        assert rest.q[1] == 0.5
        assert rest_test(robot, rest.q, ["panda_joint2"], goal, rows="pose").passes()


def test_at_the_goal_nothing_is_commanded() -> None:
    robot = links(1, 1, 1)
    q = np.array([0.3, 0.5, 0.7])
    assert rest_test(robot, q, ["j1"], robot.pose(q)).rest == 0.0


def test_singular_configuration_passes_no_test() -> None:
    found = rest_test(links(1, 1, 1), np.zeros(3), ["j1"], (1.0, 1.0))
    assert found.full_rank < 1e-12
    assert np.isnan(found.rest)
    assert not found.passes()


@pytest.mark.parametrize(
    ("locked", "sentence"),
    [(["j1", "j2", "j3"], "names all 3 joints"), ("j9", "is not a joint"), ([], "at least one joint")],
)
def test_silly_locks_are_refused(locked: object, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        rest_test(links(1, 1, 1), np.zeros(3), locked, (1.0, 1.0))  # type: ignore[arg-type]
