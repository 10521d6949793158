"""A step is a window onto the planner: valid until the next one, unless copied."""

import pickle
import tracemalloc
from copy import copy, deepcopy

import numpy as np
import pytest
from tests.arm_at import arm_at

import ftqp
from ftqp.qp import SolveStatus

DT = 2e-3


@pytest.fixture
def planner(panda, level):
    planner = ftqp.Planner(panda, DT, level=level, emergency=None)
    planner.reset(panda.neutral)
    return planner


def moving(home, speed=0.05):
    return ftqp.Target(pose=home, twist=[speed, 0, 0, 0, 0, 0])


def test_arrays_of_a_step_are_views_that_the_next_step_overwrites(planner, panda, home):
    step = planner.step(panda.neutral, np.zeros(7), moving(home))
    held, value = step.q, step.q.copy()
    again = planner.step(step.q.copy(), step.v.copy(), moving(home))
    assert again is step and again.q is held
    assert (held != value).any()


def test_copy_is_untouched_by_later_steps(planner, panda, home):
    step = planner.step(panda.neutral, np.zeros(7), moving(home))
    kept = step.copy()
    names = ("q", "v", "a", "tau", "tau_brake", "task_error", "slack", "lower", "upper")
    before = {name: np.array(getattr(kept, name)) for name in names}
    status, error, report = kept.status, kept.position_error, kept.qp
    planner.report(ftqp.Locked(3))
    bad = planner.step(np.full(7, np.nan), np.zeros(7), moving(home, 9.0))
    assert bad.status is ftqp.StepStatus.INVALID_INPUT
    for name in names:
        np.testing.assert_array_equal(getattr(kept, name), before[name])
    assert (kept.status, kept.position_error, kept.qp) == (status, error, report)


def test_command_integrates_exactly_what_was_decided(planner, panda, home, level):
    v = np.linspace(-0.05, 0.05, 7)
    planner.reset(panda.neutral, v)
    step = planner.step(panda.neutral, v, moving(home))
    np.testing.assert_allclose(step.v, v + DT * step.a, atol=1e-15)
    travelled = v + 0.5 * DT * step.a if level == "acceleration" else step.v
    np.testing.assert_allclose(step.q, panda.neutral + DT * travelled, atol=1e-15)


def test_decision_lies_in_the_intervals_that_the_step_tells(planner, panda, home, level):
    step = planner.step(panda.neutral, np.zeros(7), moving(home, 5.0))
    x = step.a if level == "acceleration" else step.v
    assert np.all(x >= step.lower - 1e-9) and np.all(x <= step.upper + 1e-9)
    assert np.any(np.isclose(x, step.lower) | np.isclose(x, step.upper))


def test_limits_that_hold_the_command_back_are_named(panda, level, follow, home):
    """Joint 1 alone can turn the tip about the base axis; ask it for more than its velocity."""
    planner = ftqp.Planner(panda, DT, level=level, task=ftqp.Task(rows=("x", "y")), emergency=None)
    radius = float(np.hypot(*home[:2, 3]))
    *_, last = follow(planner, moving(home, 0.0), 5)
    assert last.limits_active == ()
    target = ftqp.Target(pose=home)
    target.twist[1] = 20.0 * radius
    target.acceleration[1] = 2000.0 if level == "acceleration" else 0.0
    planner.reset(panda.neutral)
    step = planner.step(panda.neutral, np.zeros(7), target)
    assert "panda_joint1 upper acceleration" in step.limits_active
    v = np.zeros(7)
    v[0] = panda.limits.v_max[0]
    planner.reset(panda.neutral, v)
    step = planner.step(panda.neutral, v, target)
    assert "panda_joint1 upper velocity" in step.limits_active


def test_joint_at_its_end_names_its_position(panda, level, home):
    q = panda.neutral.copy()
    q[0] = panda.limits.q_max[0]
    target = ftqp.Target(pose=panda.pose(q))
    z = panda.pose(q)[:3, 3]
    target.twist[:2] = 0.1 * np.array([-z[1], z[0]])
    planner = ftqp.Planner(panda, DT, level=level, emergency=None)
    planner.reset(q)
    step = planner.step(q, np.zeros(7), target)
    assert "panda_joint1 upper position" in step.limits_active


def test_locked_joint_has_a_brake_torque_and_no_motor_torque(panda, home, level):
    planner = ftqp.Planner(panda, DT, level=level)
    planner.report(ftqp.Locked(1))
    planner.reset(panda.neutral)
    step = planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home))
    assert step.tau[1] == 0.0 and abs(step.tau_brake[1]) > 1.0
    np.testing.assert_array_equal(np.delete(step.tau_brake, 1), 0.0)


def test_torques_are_those_of_inverse_dynamics(planner, panda, home):
    pinocchio = pytest.importorskip("pinocchio")
    v = np.linspace(-0.2, 0.2, 7)
    planner.reset(panda.neutral, v)
    step = planner.step(panda.neutral, v, moving(home))
    expected = pinocchio.rnea(panda.model, panda.model.createData(), panda.neutral, v, step.a.copy())
    np.testing.assert_allclose(step.tau, expected, atol=1e-9 * np.abs(expected).max())


def test_torques_of_a_robot_without_inertia_are_not_numbers(srs7, level):
    planner = ftqp.Planner(srs7, DT, level=level)
    planner.reset(srs7.neutral)
    step = planner.step(srs7.neutral, np.zeros(7), ftqp.Target(pose=srs7.pose(srs7.neutral)))
    assert np.isnan(step.tau).all() and np.isnan(step.tau_brake).all()


def test_report_of_the_qp_is_solved_with_small_residuals(planner, panda, home):
    report = planner.step(panda.neutral, np.zeros(7), moving(home, 0.002)).qp
    assert report.status is SolveStatus.SOLVED
    assert 0.0 <= report.residual <= 1e-9
    assert report.residual == max(report.residual_task, report.residual_bounds, report.residual_dual)


def test_step_without_a_task_has_no_report_of_a_qp(planner, panda, home):
    target = moving(home)
    target.twist[0] = np.nan
    step = planner.step(panda.neutral, np.zeros(7), target)
    assert step.qp.status is None and step.certificate is None and not step.slack.any()


def test_infeasible_hard_task_is_not_reported_solved(panda, home, level):
    planner = ftqp.Planner(panda, DT, level=level, task=ftqp.Task(mode="hard"), emergency=None)
    planner.reset(panda.neutral)
    step = planner.step(panda.neutral, np.zeros(7), moving(home, 50.0))
    assert step.status is ftqp.StepStatus.RELAXED and step.qp.status is not SolveStatus.SOLVED


def test_step_says_its_status_and_errors(planner, panda, home):
    step = planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home))
    assert repr(step).startswith("Step(OK, position_error=") and "rotation_error=" in repr(step)


def test_singularity_measures_are_those_of_the_healthy_joints_and_survive_a_copy(panda, home):
    planner = ftqp.Planner(panda, 0.001)
    planner.reset(panda.neutral)
    planner.report(ftqp.Locked(2))
    step = planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home))
    J = arm_at(panda, panda.neutral).J
    J[:3] /= panda.length
    s = np.linalg.svd(np.delete(J, 2, axis=1))[1]
    for one in (step, step.copy()):
        assert one.sigma_min == pytest.approx(s[-1], rel=1e-9)
        assert one.manipulability == pytest.approx(np.prod(s), rel=1e-9)
        assert one.condition == pytest.approx(s[0] / s[-1], rel=1e-9)
        assert one.kappa == 0.0
    kept = step.copy()
    before = kept.measures
    q = panda.neutral + 0.3
    planner.step(q, np.zeros(7), ftqp.Target(pose=panda.pose(q)))
    assert kept.measures == before != step.measures


def test_measures_are_those_of_the_task_rows_even_while_the_arm_stops(panda, home):
    planner = ftqp.Planner(panda, 0.001, task=ftqp.Task(rows="position_axis"))
    planner.reset(panda.neutral)
    running = planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home)).measures
    bad = ftqp.Target(pose=home)
    bad.twist[0] = np.nan
    step = planner.step(panda.neutral, np.zeros(7), bad)
    assert step.status is ftqp.StepStatus.INVALID_INPUT and step.measures == running
    J = arm_at(panda, panda.neutral).J
    J[:3] /= panda.length
    J[3:] = panda.pose(panda.neutral)[:3, :3].T @ J[3:]
    assert running.sigma_min == pytest.approx(np.linalg.svd(J[:5])[1][-1], rel=1e-9)


def test_measures_follow_the_arm_while_it_stops(panda, home, level):
    planner = ftqp.Planner(panda, DT, level=level)
    q, v = panda.neutral.copy(), np.full(7, 0.5)
    planner.reset(q, v)
    target = moving(home)
    for _ in range(5):
        step = planner.step(q, v, target)
        target.twist[0] = np.nan
        J = arm_at(panda, q).J
        J[:3] /= panda.length
        assert step.sigma_min == pytest.approx(np.linalg.svd(J)[1][-1], rel=1e-9)
        q, v = step.q.copy(), step.v.copy()
    assert step.status is ftqp.StepStatus.INVALID_INPUT


def test_reading_measures_changes_no_later_step(panda, home):
    ends = []
    for read in (False, True):
        planner = ftqp.Planner(panda, 0.001, task=ftqp.Task(mode="lexicographic"))
        q, v = panda.neutral.copy(), np.zeros(7)
        planner.reset(q)
        for k in range(20):
            home_k = home.copy()
            home_k[0, 3] += 1e-4 * k
            step = planner.step(q, v, ftqp.Target(pose=home_k))
            if read:
                assert step.measures.sigma_min > 0.0
            q, v = step.q.copy(), step.v.copy()
        ends.append(q)
    assert np.array_equal(*ends)


SAID = ("q", "v", "a", "tau", "tau_brake", "task_error", "slack", "lower", "upper", "status", "code", "scale",
        "position_error", "rotation_error", "measures", "sigma_min", "manipulability", "condition", "kappa",
        "torque_excess", "certificate", "limits_active", "qp")  # fmt: skip
"""All that a step tells."""
AGAIN = [ftqp.Step.copy, copy, deepcopy, lambda step: pickle.loads(pickle.dumps(step))]


def told(step):
    return {name: np.array(x) if isinstance(x := getattr(step, name), np.ndarray) else x for name in SAID}


def on_its_way(panda, home, level):
    """A planner with a locked joint and its state, beyond what the limits allow."""
    planner = ftqp.Planner(panda, DT, level=level, emergency=None)
    q, v = panda.neutral.copy(), np.zeros(7)
    planner.reset(q)
    planner.report(ftqp.Locked(1))
    for _ in range(15):
        step = planner.step(q, v, moving(home, 3.0))
        q, v = step.q.copy(), step.v.copy()
    return planner, q, v


@pytest.mark.parametrize("again", AGAIN, ids=["method", "copy", "deepcopy", "pickle"])
def test_kept_step_tells_what_the_live_one_told_however_late_it_is_asked(panda, home, level, again):
    planner, q, v = on_its_way(panda, home, level)
    live = told(planner.step(q, v, moving(home, 3.0)))
    assert live["certificate"] is not None and live["limits_active"] and live["tau_brake"].any()
    planner, q, v = on_its_way(panda, home, level)
    kept = again(planner.step(q, v, moving(home, 3.0)))
    planner.withdraw(1)
    planner.report(ftqp.Locked(4))
    planner.report(ftqp.FreeSwinging(6))
    for k in range(3):
        assert planner.step(q + 0.1 * k, np.full(7, 0.1), ftqp.Target(pose=home)).condition > 1.0
    found = told(kept)
    for name in SAID:
        np.testing.assert_array_equal(found[name], live[name], err_msg=name)
    assert all((told(kept)[name] == live[name]).all() for name in ("tau", "tau_brake"))


def test_copy_of_a_kept_step_is_a_step_of_its_own(planner, panda, home):
    kept = planner.step(panda.neutral, np.zeros(7), moving(home)).copy()
    other = kept.copy()
    assert not np.shares_memory(kept.q, other.q) and kept.status is other.status


def test_copy_of_a_step_is_small(planner, panda, home):
    step = planner.step(panda.neutral, np.zeros(7), moving(home))
    step.copy()
    tracemalloc.start()
    kept = step.copy()
    size, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert size < 8000 and kept.status is step.status


@pytest.mark.parametrize("again", AGAIN[1:], ids=["copy", "deepcopy", "pickle"])
def test_planner_refuses_to_be_copied_with_one_sentence(planner, again):
    with pytest.raises(TypeError, match=r"neither copied nor pickled; make another .* step\.copy\(\)"):
        again(planner)
