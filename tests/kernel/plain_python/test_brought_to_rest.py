"""What stops an arm and how it is brought to rest: when it stops, what it is drawn to, and its torques."""

import numpy as np
import pytest
from records import chain_record, empty_record

import ftqp
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.judge import solution_check, stage_problems
from ftqp.kernel.layout.enums import ACCELERATION, MAIN_STAGE, SLACK, VELOCITY
from ftqp.kernel.ticks import going_on

N, DT = 4, 0.01


def record():
    """An arm of four joints that work."""
    K = empty_record()
    K.chain.n, K.state.dt, K.state.level = N, DT, ACCELERATION
    K.faults.order[:N], K.faults.working, K.faults.movable = range(N), N, N
    K.limits.q_min[:], K.limits.q_max[:], K.limits.v_max[:], K.limits.a_max[:] = -1.0, 1.0, 2.0, 5.0
    K.task.m, K.task.mode, K.task.scale = 2, SLACK, 1.0
    K.qp.nx, K.qp.meq, K.qp.warm = N, 2, 7
    K.qp.lb[:N], K.qp.ub[:N] = -5.0, 5.0
    K.cascade.stage, K.cascade.jump, K.watch.fallback_limit = MAIN_STAGE, 1.0, 3
    return K


def test_a_rest_forgets_the_task_and_opens_only_intervals_of_joints_that_are_outside():
    for q, opened in ((1.0 + 1e-3, True), (-1.0 - 1e-3, True), (1.0, False), (0.0, False)):
        K = record()
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
        stage_problems.only_brake(K, share)
        assert (K.qp.lb[1], K.qp.ub[1]) == pytest.approx((coast + low, coast + high))


def test_a_deceleration_comes_up_and_goes_down_by_its_jerk_limit():
    """What is braked now may be less than a tick ago by jerk dt only, and no more than ends at rest."""
    jerk = 8.0 / 0.04
    assert stage_problems.deceleration(0.05, -8.0, 8.0, 0.004, 0.04, 0.004) == pytest.approx(
        -(8.0 - jerk * 0.004)
    )
    assert stage_problems.deceleration(1.0, -2.0, 8.0, 0.004, 0.04, 0.004) == pytest.approx(
        -(2.0 + jerk * 0.004)
    )
    assert stage_problems.deceleration(1e-3, -8.0, 8.0, 0.004, 0.04, 0.004) == pytest.approx(-0.25)


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


@pytest.mark.parametrize("z", [1.0, -1.0])
def test_a_multiplier_of_a_bound_that_is_not_met_does_not_pass(z):
    for x, lb, ub, passes in ((0.0, -1.0, 1.0, False), (z, -1.0, 1.0, True), (0.0, 0.0, 0.0, True)):
        K = empty_record()
        K.qp.nx, K.cascade.accept = 1, 1e-6
        K.qp.H_diagonal[0], K.qp.x[0], K.qp.z_box[0] = 1.0, x, z
        K.qp.g[0], K.qp.lb[0], K.qp.ub[0] = -x - z, lb, ub
        assert bool(solution_check.check_solution(K.task, K.cascade, K.qp, K.scratch)) == passes
        assert (K.cascade.residual_dual > 0.1) != passes
