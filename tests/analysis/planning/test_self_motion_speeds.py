"""Plans by the speed of the self-motion."""

import numpy as np
from tests.analysis.planar_arms import Q0, TASK, survives
from tests.analysis.planar_arms import UNIT as ARM

from ftqp.analysis.planning.plan_case import PlanCase, PlanSettings
from ftqp.analysis.planning.planned import plan
from ftqp.analysis.planning.self_motion_speeds import constant_plan, spline_plan
from ftqp.analysis.planning.survival_labels import survivals
from ftqp.analysis.survival.continuing import track

FEW = PlanSettings(thetas=tuple(np.linspace(-1.0, 1.0, 11)), evaluations=40)
ALIKE = np.ones(3)


def silent(done: int, total: int, what: str) -> None:
    assert 0 <= done <= total and what


def case(settings=FEW, told=silent, task=TASK, weights=ALIKE) -> PlanCase:
    return PlanCase(task=task, weights=weights, settings=settings, notify=told)


def coverage_of(q: np.ndarray) -> float:
    return float(survivals(TASK, q[None], 4).coverage[0])


def test_best_constant_speed_is_that_of_all_that_are_tried() -> None:
    q, speeds = constant_plan(case(), Q0[None])
    each = [coverage_of(track(TASK, Q0, theta)) for theta in FEW.thetas]
    assert coverage_of(q) == max(each) == each[int(np.argmin(np.abs(FEW.thetas - speeds[0])))]


def test_interrupted_search_of_splines_keeps_the_best_so_far() -> None:
    def interrupt(done: int, total: int, what: str) -> None:
        if what == "splines" and done == 10:
            raise KeyboardInterrupt

    q, _ = spline_plan(case(told=interrupt), Q0[None])
    assert coverage_of(q) >= coverage_of(constant_plan(case(), Q0[None])[0])


def test_corridor_ends_where_the_closed_form_says_that_a_joint_is_lost() -> None:
    made = plan(ARM, TASK, settings=PlanSettings(waypoints=25, spacing=0.2))
    corridor = made.corridor(stride=10, widest=3.0, spacing=0.02)
    assert (corridor.low > 0.0).all() and (corridor.high > 0.0).all()
    ended = 0
    for row, k in enumerate(corridor.samples):
        for reach, q, side in (
            (corridor.low, corridor.q_low, -1.0),
            (corridor.high, corridor.q_high, 1.0),
        ):
            assert np.abs(ARM.pose(q[row])[:2, 3] - TASK.goals[k, :2, 3]).max() < 1e-9
            assert survives(q[row][None], k).all()
            if reach[row] < 2.9:
                s2, s3, s23 = np.sin(q[row, 1]), np.sin(q[row, 2]), np.sin(q[row, 1] + q[row, 2])
                n = np.array([s3, -(s3 + s23), s2 + s23])
                beyond = q[row] + side * 0.03 * n / np.linalg.norm(n)
                ended += not survives(beyond[None], k).all()
    assert ended >= 5
