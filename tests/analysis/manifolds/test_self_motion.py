"""Self-motions of planar and spatial arms, with and without joint limits."""

import numpy as np
import pytest
from planar_arms import links

from ftqp.analysis.goals import goal_study
from ftqp.analysis.manifolds.joint_ranges import joint_ranges
from ftqp.analysis.manifolds.manifold import self_motion
from ftqp.core.errors import InputError
from ftqp.model import catalog


def components(lengths: tuple[float, float, float], R: float) -> int:
    """How many self-motions three links have: arcs of the last link's angle that the first two reach."""
    l1, l2, l3 = lengths
    psi = np.linspace(0.0, 2.0 * np.pi, 100_001)[:-1]
    wrist = np.hypot(R - l3 * np.cos(psi), l3 * np.sin(psi))
    inside = (wrist >= abs(l1 - l2)) & (wrist <= l1 + l2)
    return 2 if inside.all() else int((inside & ~np.roll(inside, 1)).sum())


@pytest.mark.parametrize("lengths", [(1.0, 1.0, 1.0), (1.0, 0.6, 0.4), (0.5, 1.0, 0.9)])
def test_three_links_have_as_many_self_motions_as_the_closed_form_says(
    lengths: tuple[float, float, float],
) -> None:
    for R in np.linspace(0.13, sum(lengths) - 0.07, 9):
        assert len(self_motion(links(*lengths), (R, 0.0))) == components(lengths, R)


def test_points_of_a_panda_keep_pose_and_limits() -> None:
    robot = catalog.load("panda")
    goal = robot.pose(robot.neutral + 0.2)
    found = self_motion(robot, goal)
    assert found
    limits = robot.limits
    for manifold in found:
        assert not manifold.closed
        assert not manifold.singular
        assert max(np.abs(robot.pose(q) - goal).max() for q in manifold.q) < 1e-11
        assert ((manifold.q >= limits.q_min) & (manifold.q <= limits.q_max)).all()
        for q in (manifold.q[0], manifold.q[-1]):
            assert min(np.abs(q - limits.q_min).min(), np.abs(limits.q_max - q).min()) < 1e-9
    away = [np.linalg.norm(m.q - (robot.neutral + 0.2), axis=1).min() for m in found]
    assert min(away) < 0.05  # the configuration that made the goal is on one of them


def test_every_solution_within_limits_is_on_a_self_motion() -> None:
    robot = catalog.load("panda")
    goal = robot.pose(robot.neutral + 0.2)
    found = np.vstack([manifold.q for manifold in self_motion(robot, goal)])
    study = goal_study(robot, goal, "pose")
    rng = np.random.default_rng(11)
    q, left, _ = study.limited.solutions(
        rng.uniform(robot.limits.q_min, robot.limits.q_max, (300, 7)), bounded=True
    )
    solutions = q[left < 1e-11]
    assert len(solutions) > 30
    for solution in solutions:
        assert np.linalg.norm(found - solution, axis=1).min() < 0.06


def test_spread_points_are_equally_far_apart() -> None:
    (manifold,) = self_motion(links(1, 1, 1), (1.5, 1.5))
    q = manifold.spread(300)
    gaps = np.linalg.norm(np.diff(np.vstack([q, q[:1]]), axis=0), axis=1)
    assert gaps == pytest.approx(manifold.length / 300, rel=1e-3)


def test_samples_of_two_joints_to_spare_claim_no_components() -> None:
    robot = links(1, 1, 1, 1)
    (manifold,) = self_motion(robot, (1.5, 1.5))
    assert not manifold.connected
    assert manifold.dimension == 2
    assert len(manifold.q) > 100
    assert manifold.ranges() == joint_ranges(robot, (1.5, 1.5))
    assert max(np.abs(robot.pose(q)[:2, 3] - 1.5).max() for q in manifold.q) < 1e-11


def test_goal_out_of_reach_is_refused() -> None:
    with pytest.raises(InputError, match=r"is not reached by planar\(1, 1, 1\) \(nearest: 0\.50"):
        self_motion(links(1, 1, 1), (3.5, 0.0))
    with pytest.raises(InputError, match="only outside its joint limits"):
        self_motion(catalog.load("planar", lengths=(1, 1, 1)).with_limits(q_max=0.1, q_min=-0.1), (0.5, 0.0))
    with pytest.raises(InputError, match="at the edge of the workspace"):
        self_motion(links(1, 1, 1), (3.0, 0.0))


def test_arm_without_a_joint_to_spare_is_refused() -> None:
    with pytest.raises(InputError, match="has no self-motion"):
        self_motion(links(1, 1), (1.0, 1.0))


def test_piece_within_limits_that_is_shorter_than_a_step_is_found() -> None:
    highest = joint_ranges(links(1, 1, 1), (1.5, 1.5))["j1"].intervals[0][1]
    low = np.array([highest - 1e-5, -2.9, -2.9])
    robot = catalog.load("planar", lengths=(1, 1, 1)).with_limits(q_min=low, q_max=2.9)
    (manifold,) = self_motion(robot, (1.5, 1.5))
    assert 1e-3 < manifold.length < 0.03
    assert manifold.q[[0, -1], 0] == pytest.approx([low[0]] * 2, abs=1e-10)
    assert manifold.ranges()["j1"].intervals[0] == pytest.approx((low[0], highest), abs=1e-9)


def test_joint_with_a_range_of_two_turns_has_every_copy_of_a_piece() -> None:
    one = catalog.load("planar", lengths=(1, 1, 1)).with_limits(
        q_min=[-np.pi, -2.5, -2.5], q_max=[np.pi, 2.5, 2.5]
    )
    two = one.with_limits(q_min=[-np.pi, -2.5, -2.5], q_max=[3.0 * np.pi, 2.5, 2.5])
    single, double = self_motion(one, (1.5, 1.5)), self_motion(two, (1.5, 1.5))
    assert len(single) == 1
    assert single[0].closed
    assert len(double) == 2
    first = sorted(float(manifold.q[:, 0].mean()) for manifold in double)
    assert first[1] - first[0] == pytest.approx(2.0 * np.pi, abs=0.05)
