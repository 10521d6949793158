"""A step is a window onto the planner: valid until the next one, unless copied."""

import pickle
from copy import copy, deepcopy

import numpy as np
import pytest
from tests.arm_at import arm_at

import ftqp
from ftqp.control.planner.planner_view import row_labels, variable_labels
from ftqp.qp import Recorder

DT = 2e-3


@pytest.fixture
def planner(panda, level):
    planner = ftqp.Planner(panda, DT, level=level, emergency=None)
    planner.reset(panda.neutral)
    return planner


def moving(home, speed=0.05):
    return ftqp.Target(pose=home, twist=[speed, 0, 0, 0, 0, 0])


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


@pytest.mark.parametrize("again", AGAIN[1:], ids=["copy", "deepcopy", "pickle"])
def test_planner_refuses_to_be_copied_with_one_sentence(planner, again):
    with pytest.raises(TypeError, match=r"neither copied nor pickled; make another .* step\.copy\(\)"):
        again(planner)


SLACKS = tuple(f"slack {row}" for row in ("x", "y", "z"))
EXTRA = {"hard": (), "slack": SLACKS, "lexicographic": SLACKS, "scaled": ("scale", *SLACKS)}


@pytest.mark.parametrize("mode", EXTRA)
@pytest.mark.parametrize("keeps", [False, True])
@pytest.mark.parametrize("name", ["panda", "srs7"])
def test_every_variable_and_row_has_a_name(name, keeps, mode):
    robot = ftqp.robots.load(name)
    recorder = Recorder("active_set")
    kept = [ftqp.Keep(robot.tip, above=(0.0, 0.0, -5.0), name="floor")] if keeps else None
    task = ftqp.Task(rows="position", mode=mode)
    planner = ftqp.Planner(robot, 2e-3, task=task, backend=recorder, constraints=kept)
    planner.reset(robot.neutral)
    planner.step(robot.neutral, np.zeros(7), ftqp.Target(pose=robot.pose(robot.neutral)))
    variables, rows = variable_labels(planner), row_labels(planner)
    recording = recorder.recording(dt=2e-3, variables=variables, rows=rows)
    assert recording.variables == (*robot.joints, *EXTRA[mode])
    torques = tuple(f"torque {joint}" for joint in robot.joints)
    rows_of_C = (torques if name == "panda" else ()) + (("keep floor",) if keeps else ())
    assert recording.rows == ("x", "y", "z", *rows_of_C)


def test_planner_counts_its_steps_from_zero(planar6):
    planner = ftqp.Planner(planar6, 0.01)
    target = ftqp.Target(pose=planar6.pose(planar6.neutral))
    assert planner.tick == -1
    for _ in range(2):
        planner.reset(planar6.neutral)
        for k in range(3):
            planner.step(planar6.neutral, np.zeros(6), target)
            assert planner.tick == k
