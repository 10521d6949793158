"""Studies that follow one serial arm refuse a robot with branches in one sentence."""

import numpy as np
import pytest
from planar_arms import links

import ftqp
from ftqp import analysis
from ftqp.analysis.goals import goal_study
from ftqp.core.errors import InputError

DUAL = ftqp.robots.load("dual_panda")
Q = DUAL.neutral
T = DUAL.pose(Q)
CIRCLE = ftqp.paths.Circle(T, 0.05, duration=1.0)


@pytest.mark.parametrize(
    "study",
    [
        lambda: analysis.self_motion(DUAL, T),
        lambda: analysis.structural_joints(DUAL),
        lambda: analysis.learned_run(DUAL, T[:3, 3], Q),
        lambda: analysis.survival_map(DUAL),
        lambda: analysis.rest_curves(DUAL, T[:3, 3], 0),
        lambda: analysis.convergence_rates(DUAL, Q),
        lambda: analysis.outcome(DUAL, T[:3, 3], Q, 0),
        lambda: analysis.workspace(DUAL, T[:3, 3], rows="position"),
        lambda: analysis.joint_ranges(DUAL, T),
        lambda: analysis.reachable_after(DUAL, T, {0: 0.0}),
    ],
)
def test_study_of_a_tree_is_one_clear_sentence(study):
    with pytest.raises(ftqp.InputError, match="needs one serial arm, but dual_panda has joints beside"):
        study()


def test_coverage_of_a_tree_is_that_of_the_way_to_its_tip():
    report = analysis.coverage(DUAL, CIRCLE, np.tile(Q, (2, 1)))
    assert set(report.names) <= set(DUAL.joints) and len(report.names) == 7


def test_planar_studies_say_that_it_is_no_planar_arm():
    with pytest.raises(ftqp.InputError, match="expected a planar arm of three revolute joints"):
        analysis.basins(DUAL, T[:2, 3], 1, 0.0)


def test_one_arm_of_it_is_studied_like_any_other():
    one = ftqp.Robot.from_pinocchio(DUAL.model, "right_hand", limits={"a_max": 10.0})
    alone = ftqp.robots.load("panda")
    assert analysis.structural_joints(one) == analysis.structural_joints(alone) == ()
    assert len(analysis.self_motion(one, one.pose(one.neutral))) > 0


def test_falls_are_those_of_each_arm():
    found, alone = analysis.fall_energy(DUAL, Q), analysis.fall_energy(ftqp.robots.load("panda"), Q[:7])
    for side in ("left", "right"):
        own = [found[f"{side}_joint{i}"] for i in range(1, 8)]
        assert own == pytest.approx(list(alone.values()), abs=1e-9)


@pytest.mark.parametrize(
    ("goal", "rows", "sentence"),
    [
        ((1.0, 2.0, 3.0, 4.0), "pose", r"shape \(4,\), expected a point"),
        ((1.0, np.nan), "pose", "contains NaN"),
        ((1.0, 1.0), ("x", "y", "rz"), "give a pose"),
        ((1.0, 1.0), ("x", "z"), r"give a point \(3,\)"),
        ((1.0, 1.0, 0.0), ("x", "y", "z"), "do not move independently"),
        ((1.0, 1.0), "position_axis", "expected 'pose', 'position' or names"),
        (np.ones((4, 4)), "pose", "not a rotation"),
    ],
)
def test_goal_that_does_not_fit_its_rows_is_refused(goal: object, rows: object, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        goal_study(links(1, 1, 1), goal, rows)
