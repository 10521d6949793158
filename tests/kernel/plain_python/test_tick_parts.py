"""Parts of a tick that decide about a stop, and what an answer's multipliers have to be."""

import numpy as np
import pytest
from records import empty_record

from ftqp.kernel.feedback import status_report
from ftqp.kernel.judge import kept_limits, solution_check
from ftqp.kernel.layout.enums import LAGGING, OK, RELAXED
from ftqp.kernel.ticks import tick

N = 8


def stubs(monkeypatch, **said):
    """Parts of the tick that answer what the test says, and the names of those that were asked."""
    asked = []
    for name, value in said.items():

        def part(*given, name=name, value=value):
            asked.append(name)
            return value(*given) if callable(value) else value

        monkeypatch.setattr(tick, name, part)
    return asked


@pytest.mark.parametrize("emergency", [True, False])
def test_an_emergency_and_nothing_else_stops_an_arm_whose_input_is_valid(monkeypatch, emergency):
    K = empty_record()
    parts = dict.fromkeys(("pose_error", "see_error", "displace"))
    asked = stubs(monkeypatch, _emergency=emergency, _stop=False, _refuse_target=False, **parts)
    assert tick._may_go_on(K, True) == (not emergency)
    assert ("_stop" in asked) == emergency and "_refuse_target" not in asked
    assert not tick._may_go_on(K, False) and asked[-1] == "_refuse_target"


@pytest.mark.parametrize("what", ["displaced", "late", "latency", "nothing"])
def test_the_error_that_may_stop_is_that_to_the_target_that_is_followed(what):
    """Where samples or targets are late, or the target is displaced, it is the task's own error."""
    K = empty_record()
    K.task.m, K.task.rows[:3], K.task.length = 3, [0, 1, 2], 1.0
    K.task.position_error, K.task.error[:3] = 9.0, [0.3, 0.0, 0.4]
    K.watch.stop_position, K.watch.stop_rotation, K.watch.stop_samples = 1.0, 1.0, 100
    if what != "nothing":
        K.feedback[what] = 1
    assert not tick._emergency(K)
    assert K.watch.last_position_error == pytest.approx(9.0 if what == "nothing" else 0.5)
    assert K.watch.rising == (1 if what == "nothing" else 0)


@pytest.mark.parametrize("factor", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("calm", [True, False])
def test_directions_are_damped_where_a_planner_says_so_and_not_in_calm(monkeypatch, factor, calm):
    K = empty_record()
    K.turned.factor, K.turned.on = factor, 1
    asked = stubs(monkeypatch, turn_rows=None, add_manipulability=None)
    tick._turn(K, calm)
    assert ("turn_rows" in asked) == (factor > 0.0 and not calm) and K.turned.on == 0


@pytest.mark.parametrize("z", [1.0, -1.0])
def test_a_multiplier_of_a_bound_that_is_not_met_does_not_pass(z):
    for x, lb, ub, passes in ((0.0, -1.0, 1.0, False), (z, -1.0, 1.0, True), (0.0, 0.0, 0.0, True)):
        K = empty_record()
        K.qp.nx, K.cascade.accept = 1, 1e-6
        K.qp.H_diagonal[0], K.qp.x[0], K.qp.z_box[0] = 1.0, x, z
        K.qp.g[0], K.qp.lb[0], K.qp.ub[0] = -x - z, lb, ub
        assert bool(solution_check.check_solution(K)) == passes
        assert (K.cascade.residual_dual > 0.1) != passes


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_joints_are_counted_that_are_all_beyond_their_range(side):
    K = empty_record()
    K.chain.n = N
    K.limits.q_min[:N], K.limits.q_max[:N], K.limits.v_max[:N] = -1.0, 1.0, 1.0
    K.state.q[:N] = side * 1.5
    assert kept_limits.joints_outside(K) == N
    K.state.q[:N] = np.where(np.arange(N) < 5, side * 1.5, 0.0)
    assert kept_limits.joints_outside(K) == 5


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    ("sigma", "beyond", "said"), [(0.0, 2e-6, LAGGING), (1e-4, 5e-4, OK), (1e-4, 7e-4, LAGGING)]
)
def test_ok_becomes_lagging_where_a_joint_is_measured_beyond_its_range(side, sigma, beyond, said):
    K = empty_record()
    K.chain.n, K.feedback.active, K.feedback.sigma = N, 1, sigma
    K.feedback.tolerance = K.feedback.rotation_tolerance = 1.0
    K.limits.q_min[:N], K.limits.q_max[:N] = -1.0, 1.0
    K.feedback.seen[5] = side * (1.0 + beyond)
    assert status_report.report_status(K, OK) == said and status_report.report_status(K, RELAXED) == RELAXED
