"""Plans by the speed of the self-motion."""

from dataclasses import replace

import numpy as np
import pytest
from planar_arms import Q0, START, TASK
from planar_arms import UNIT as ARM

from ftqp.analysis.planning.plan_case import PlanCase, PlanSettings, planning_study
from ftqp.analysis.planning.planned import gradient_plan, measure
from ftqp.analysis.planning.self_motion_speeds import constant_plan, null_vectors, spline_plan
from ftqp.analysis.planning.survival_labels import survivals
from ftqp.analysis.survival.continuing import track
from ftqp.analysis.survival.task_path import task_path
from ftqp.control.paths import Line
from ftqp.core.errors import InputError

STUDY = planning_study(TASK, 0.1)
FEW = PlanSettings(thetas=tuple(np.linspace(-1.0, 1.0, 11)), evaluations=40)
ALIKE = np.ones(3)


def silent(done: int, total: int, what: str) -> None:
    assert 0 <= done <= total and what


def case(settings=FEW, told=silent, task=TASK, weights=ALIKE) -> PlanCase:
    return PlanCase(task=task, weights=weights, settings=settings, told=told)


def coverage_of(q: np.ndarray) -> float:
    return float(survivals(TASK, q[None], 4).coverage[0])


def test_null_vectors_are_those_of_the_planar_arm() -> None:
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (50, 3))
    s2, s3, s23 = np.sin(q[:, 1]), np.sin(q[:, 2]), np.sin(q[:, 1] + q[:, 2])
    Z = np.stack([s3, -(s3 + s23), s2 + s23], axis=1)
    assert np.allclose(null_vectors(STUDY, q), Z / np.linalg.norm(Z, axis=1, keepdims=True), atol=1e-9)


def test_best_constant_speed_is_that_of_all_that_are_tried() -> None:
    found = constant_plan(case(), Q0[None])
    each = [coverage_of(track(TASK, Q0, theta)) for theta in FEW.thetas]
    assert coverage_of(found.q) == max(each) == each[int(np.argmin(np.abs(FEW.thetas - found.speeds[0])))]


def test_rule_of_least_energy_takes_nearly_no_self_motion() -> None:
    found = constant_plan(case(replace(FEW, select="energy")), Q0[None])
    assert abs(found.speeds[0]) <= 0.2
    assert coverage_of(found.q) < coverage_of(constant_plan(case(), Q0[None]).q)


def test_interrupted_search_of_splines_keeps_the_best_so_far() -> None:
    def interrupt(done: int, total: int, what: str) -> None:
        if what == "splines" and done == 10:
            raise KeyboardInterrupt

    found = spline_plan(case(told=interrupt), Q0[None])
    assert coverage_of(found.q) >= coverage_of(constant_plan(case(), Q0[None]).q)


def test_gradient_climbs_higher_than_least_motion() -> None:
    climbing = gradient_plan(case(), Q0).q
    least = track(TASK, Q0, 0.0)
    assert measure(STUDY, climbing, ALIKE).mean() > measure(STUDY, least, ALIKE).mean() + 0.1
    assert np.abs(np.diff(climbing, axis=0)).max() < 0.2
    assert (
        max(np.abs(ARM.pose(climbing[k])[:2, 3] - TASK.goals[k, :2, 3]).max() for k in (10, 50, 100)) < 1e-9
    )


def test_path_that_no_speed_follows_is_refused_with_its_sample() -> None:
    far = task_path(ARM, Line(START, (3.0, 0.0, 0.0), duration=10.0), dt=0.1, rows="position")
    with pytest.raises(InputError, match=r"follows the path beyond sample \d+ \(t = "):
        constant_plan(case(task=far), Q0[None])
    with pytest.raises(InputError, match=r"beyond sample \d+"):
        gradient_plan(case(task=far), Q0)
