"""What stops an arm and how it is brought to rest: when it stops, what it is drawn to, and its torques."""

from math import inf

import numpy as np
import pytest
from records import chain_record, empty_record
from stages import DT, N, answers, record

import ftqp
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.judge import coming_to_rest, solution_check, stage_problems
from ftqp.kernel.layout.enums import ACCELERATION, MAIN_STAGE, STOPPED, STOPPING, VELOCITY
from ftqp.kernel.ticks import going_on, tick


@pytest.mark.parametrize("limited", [True, False])
def test_a_stop_brakes_until_all_joints_that_work_are_slower_than_a_thousandth(monkeypatch, limited):
    top = 2.0 if limited else 1.0
    for share, latched, stopped, free, says, ends in (
        (1.1e-3, 1, 0, False, STOPPING, 0),
        (0.9e-3, 1, 0, False, STOPPED, 1),
        (0.9e-3, 0, 0, False, STOPPED, 0),
        (1.1e-3, 1, 1, False, STOPPED, 1),
        (1.1e-3, 1, 1, True, STOPPING, 1),
        (-1.1e-3, 1, 0, False, STOPPING, 0),
    ):
        K = record()
        K.limits.v_max[2] = 2.0 if limited else inf
        K.state.v[2] = share * top
        K.watch.latched, K.watch.stopped, K.watch.rise = latched, stopped, 0.2
        if free:
            K.faults.working = N - 1
        given, shares = [], []
        answers(
            monkeypatch,
            stage_problems,
            begin_rest=lambda K, time, rise, given=given: given.append((time, rise)),
            only_brake=lambda K, share, shares=shares: shares.append(share),
        )
        assert (stage_problems.begin_stop(K), K.watch.stopped) == (says, ends) and given == [(DT, 0.2)]
        assert shares == ([] if free else [0.0]), "beside a joint that swings the others may have to move"
    K = record()
    K.faults.working, K.faults.movable, K.state.v[3] = N - 1, N - 1, 1.0
    answers(monkeypatch, stage_problems, begin_rest=None, only_brake=None)
    assert stage_problems.begin_stop(K) == STOPPED, "a joint that is locked is not asked"


def test_a_rest_forgets_the_task_and_opens_only_intervals_of_joints_that_are_outside():
    for q, opened in ((1.0 + 1e-3, True), (-1.0 - 1e-3, True), (1.0, False), (0.0, False)):
        K = record(MAIN_STAGE)
        K.state.q[1], K.state.v[1] = q, 0.04
        K.task.slack[:2], K.task.scale = 5.0, 0.5
        K.qp.lb[1], K.qp.ub[1] = 1.0, 2.0
        stage_problems.begin_rest(K, 0.05, 0.0)
        assert (K.qp.nx, K.qp.meq, K.qp.warm) == (N, 0, 0)
        assert not K.task.slack[:2].any() and K.task.scale == 0.0
        wanted = -0.04 / 0.05
        assert (K.qp.lb[1], K.qp.ub[1]) == ((pytest.approx(wanted), 2.0) if opened else (1.0, 2.0))
        assert -K.qp.g[1] == pytest.approx(wanted)


@pytest.mark.parametrize("level", [ACCELERATION, VELOCITY])
def test_a_stop_leaves_each_joint_between_coasting_and_what_it_wants_unless_a_limit_wants_more(level):
    for v, rest, lb, ub, share, low, high in (
        (1.0, -4.0, -8.0, 8.0, 0.0, -4.0, 0.0),
        (1.0, -4.0, -8.0, 8.0, 0.25, -4.0, -1.0),
        (-1.0, 4.0, -8.0, 8.0, 0.25, 1.0, 4.0),
        (1.0, -4.0, -8.0, -6.0, 0.25, -6.0, -6.0),
        (1.0, -4.0, 2.0, 3.0, 0.25, 2.0, 2.0),
        (0.0, 0.0, -8.0, 8.0, 0.25, 0.0, 0.0),
    ):
        K = record()
        K.state.level = level
        coast = 0.0 if level == ACCELERATION else v
        K.state.v[1] = v
        K.qp.H_diagonal[:N], K.qp.g[1] = 2.0, -2.0 * (coast + rest)
        K.qp.lb[1], K.qp.ub[1] = coast + lb, coast + ub
        coming_to_rest.only_brake(K, share)
        assert (K.qp.lb[1], K.qp.ub[1]) == pytest.approx((coast + low, coast + high))


def test_a_deceleration_comes_up_and_goes_down_by_its_jerk_limit():
    """What is braked now may be less than a tick ago by jerk dt only, and no more than ends at rest."""
    jerk = 8.0 / 0.04
    assert coming_to_rest.deceleration(0.05, -8.0, 8.0, 0.004, 0.04, 0.004) == pytest.approx(
        -(8.0 - jerk * 0.004)
    )
    assert coming_to_rest.deceleration(1.0, -2.0, 8.0, 0.004, 0.04, 0.004) == pytest.approx(
        -(2.0 + jerk * 0.004)
    )
    assert coming_to_rest.deceleration(1e-3, -8.0, 8.0, 0.004, 0.04, 0.004) == pytest.approx(-0.25)


@pytest.mark.parametrize("level", [ACCELERATION, VELOCITY])
def test_torques_of_a_tick_without_inertia_are_known_from_then_on(level):
    robot = ftqp.robots.load("planar", count=3, vertical=True)
    K, rng = chain_record(robot), np.random.default_rng(1)
    K.state.level, K.state.dt = level, DT
    q, v, a = K.state.q[:3], K.state.v[:3], K.state.a_command[:3]
    q[:], v[:], a[:] = rng.normal(size=(3, 3))
    forward_kinematics(K, K.state)
    motion(K, K.state)
    assert K.kinematics.has_dynamics == 0
    solution_check.torques_without_inertia(K)
    assert K.state.tau[:3] == pytest.approx(robot.mass_matrix(q) @ a + robot.bias(q, v))
    assert K.kinematics.has_dynamics == 1, "asked again they are not computed again"


@pytest.mark.parametrize("emergency", [True, False])
def test_an_emergency_and_nothing_else_stops_an_arm_whose_input_is_valid(monkeypatch, emergency):
    K = empty_record()
    parts = dict.fromkeys(("pose_error", "see_error", "displace"))
    asked = answers(monkeypatch, going_on, _emergency=emergency, _stop=False, _refuse_target=False, **parts)
    assert going_on.may_go_on(K, True) == (not emergency)
    assert ("_stop" in asked) == emergency and "_refuse_target" not in asked
    assert not going_on.may_go_on(K, False) and asked[-1] == "_refuse_target"


@pytest.mark.parametrize("what", ["displaced", "late", "latency", "nothing"])
def test_the_error_that_may_stop_is_that_to_the_target_that_is_followed(what):
    """Where samples or targets are late, or the target is displaced, it is the task's own error."""
    K = empty_record()
    K.task.m, K.task.rows[:3], K.task.length = 3, [0, 1, 2], 1.0
    K.task.position_error, K.task.error[:3] = 9.0, [0.3, 0.0, 0.4]
    K.watch.stop_position, K.watch.stop_rotation, K.watch.stop_samples = 1.0, 1.0, 100
    if what != "nothing":
        K.feedback[what] = 1
    assert not going_on._emergency(K)
    assert K.watch.last_position_error == pytest.approx(9.0 if what == "nothing" else 0.5)
    assert K.watch.rising == (1 if what == "nothing" else 0)


@pytest.mark.parametrize("factor", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("calm", [True, False])
def test_directions_are_damped_where_a_planner_says_so_and_not_in_calm(monkeypatch, factor, calm):
    K = empty_record()
    K.turned.factor, K.turned.on = factor, 1
    asked = answers(monkeypatch, tick, turn_rows=None, add_manipulability=None)
    tick._turn(K, calm)
    assert ("turn_rows" in asked) == (factor > 0.0 and not calm) and K.turned.on == 0


@pytest.mark.parametrize("z", [1.0, -1.0])
def test_a_multiplier_of_a_bound_that_is_not_met_does_not_pass(z):
    for x, lb, ub, passes in ((0.0, -1.0, 1.0, False), (z, -1.0, 1.0, True), (0.0, 0.0, 0.0, True)):
        K = empty_record()
        K.qp.nx, K.cascade.accept = 1, 1e-6
        K.qp.H_diagonal[0], K.qp.x[0], K.qp.z_box[0] = 1.0, x, z
        K.qp.g[0], K.qp.lb[0], K.qp.ub[0] = -x - z, lb, ub
        assert bool(solution_check.check_solution(K.task, K.cascade, K.qp, K.scratch)) == passes
        assert (K.cascade.residual_dual > 0.1) != passes
