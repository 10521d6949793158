"""Plans: what is asked of the door, and what comes back."""

import numpy as np
import pytest
from tests.analysis.planar_arms import PATH, Q0, TASK, survives
from tests.analysis.planar_arms import UNIT as ARM

from ftqp.analysis.planning.plan_case import PlanSettings
from ftqp.analysis.planning.planned import plan
from ftqp.analysis.planning.survival_labels import survivals
from ftqp.analysis.survival.continuing import track
from ftqp.analysis.survival.coverage_report import NotSurvived
from ftqp.analysis.survival.task_path import task_path
from ftqp.control.paths import Line
from ftqp.core.errors import InputError
from ftqp.model import catalog

FEW = PlanSettings(waypoints=50, spacing=0.12, thetas=tuple(np.linspace(-1.0, 1.0, 11)), evaluations=30)


@pytest.fixture(scope="module")
def free():
    return plan(ARM, PATH, rows="position", dt=0.1, settings=FEW)


def test_free_start_of_the_planar_arm_survives_everything_and_a_given_start_nine_tenths(free) -> None:
    assert free.coverage == 1.0
    assert all(survives(free.q[[k]], k).all() for k in range(0, 100, 5))
    fixed = plan(ARM, PATH, Q0, rows="position", dt=0.1, settings=FEW)
    assert np.allclose(fixed.q[0], Q0) and 0.87 < fixed.coverage <= 0.91


def test_plan_is_on_its_path_and_within_the_speed_of_the_joints(free) -> None:
    assert free.q.shape == (101, 3) and np.isclose(free.t[-1], 10.0)
    assert (
        max(np.abs(ARM.pose(q)[:2, 3] - g[:2, 3]).max() for q, g in zip(free.q, free.goals, strict=True))
        < 1e-9
    )
    assert np.abs(free.v).max() <= 1.0 + 1e-9
    assert np.isclose(free.energy, np.square(np.diff(free.q, axis=0)).sum() / 0.1)


@pytest.mark.parametrize(
    "method", ["dp", "constant", pytest.param("spline", marks=pytest.mark.slow), "gradient"]
)
def test_a_joint_that_does_not_fail_is_given_up_for_the_others(method) -> None:
    alike, found, scaled = (
        plan(ARM, PATH, Q0, method, rows="position", dt=0.1, settings=FEW, weights=weights)
        for weights in (None, {"j2": 1.0, "j3": 1.0}, {1: 64.0, 2: 64.0})
    )
    survived = found.report.per_joint
    assert survived["j1"] < alike.report.per_joint["j1"] and survived["j2"] == survived["j3"] == 1.0
    assert found.settings["weighted_coverage"] == 1.0 > found.coverage == found.report.coverage
    assert method == "gradient" or found.energy < alike.energy
    assert np.array_equal(scaled.q, found.q)


def test_dynamic_programming_is_at_least_as_good_as_every_other_method() -> None:
    found = {
        method: plan(ARM, TASK, Q0, method, settings=FEW).coverage
        for method in ("dp", "spline", "constant", "gradient")
    }
    least = float(survivals(TASK, track(TASK, Q0)[None], 4).coverage[0])
    assert (
        found["dp"] >= max(found["constant"], found["gradient"]) - 0.005
        and found["spline"] >= found["constant"]
    )
    assert min(found.values()) > least


def test_margin_keeps_a_plan_farther_from_limits_at_the_same_coverage() -> None:
    arm = catalog.load("planar", count=3)
    way = Line(arm.pose((-1.0, 2.4, 0.5)), (-0.2, 0.4, 0.0), duration=5.0)
    made = [
        plan(
            arm,
            way,
            rows="position",
            dt=0.1,
            settings=PlanSettings(waypoints=25, spacing=0.12, margin=margin),
        )
        for margin in (0.0, 0.3)
    ]
    room = [np.minimum(p.q - arm.limits.q_min, arm.limits.q_max - p.q).min(axis=1).mean() for p in made]
    assert room[1] > room[0] + 0.3 and made[0].coverage == made[1].coverage == 1.0


def test_continuation_is_that_which_was_verified(free) -> None:
    q = free.continue_after("j2", 4.05)
    assert q.shape == (61, 3) and np.allclose(q[0], free.q[40])
    assert np.ptp(q[:, 1]) < 1e-12
    off = [np.abs(ARM.pose(one)[:2, 3] - g[:2, 3]).max() for one, g in zip(q, free.goals[40:], strict=True)]
    assert max(off) < 1e-8


def test_lock_that_is_not_survived_says_until_when_the_path_can_be_followed() -> None:
    made = plan(ARM, TASK, Q0, "constant", settings=PlanSettings(thetas=(0.0,)))
    lost = [(k, j) for k in range(0, 100, 4) for j in range(3) if not survives(made.q[[k]], k)[0, j]]
    assert lost
    k, j = lost[0]
    with pytest.raises(NotSurvived, match=f"cannot be finished when 'j{j + 1}' locks") as caught:
        made.continue_after(j, 0.1 * k)
    error = caught.value
    assert error.time <= error.until < 10.0 and len(error.q) == round((error.until - error.time) / 0.1) + 1
    last = round(error.until / 0.1)
    assert np.abs(ARM.pose(error.q[-1])[:2, 3] - TASK.goals[last, :2, 3]).max() < 1e-8


def test_two_joints_to_spare_survive_more_than_with_least_motion() -> None:
    arm = catalog.load("planar", lengths=(1, 0.6, 0.6, 0.3))
    q0 = np.array([0.2, 0.9, -0.6, 0.4])
    task = task_path(arm, Line(arm.pose(q0), (-1.0, -1.6, 0.0), duration=8.0), dt=0.1, rows="position")
    made = plan(arm, task, settings=PlanSettings(waypoints=20, nodes=80, stride=8))
    least = survivals(task, track(task, q0)[None], 8).coverage[0]
    assert made.coverage >= least
    with pytest.raises(InputError, match="2 joints to spare"):
        plan(arm, task, q0, "constant")


def test_path_outside_the_limits_is_refused_with_sample_and_joint() -> None:
    arm = catalog.load("planar", lengths=(1, 1, 1)).with_limits(
        q_min=(-0.5, -2.6, -2.6), q_max=(0.5, 2.6, 2.6)
    )
    goals = np.tile(np.eye(4), (11, 1, 1))
    goals[:, 0, 3] = np.linspace(2.5, 2.9, 11)
    angle = np.linspace(0.0, 1.5, 11)
    goals[:, :2, 3] = goals[:, :1, 3] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    task = task_path(arm, goals, dt=1.0, rows="position")
    with pytest.raises(InputError, match=r"no plan keeps all limits: 'j1' would be .* at sample 10"):
        plan(arm, task, None, "constant", settings=FEW)
    with pytest.raises(
        InputError, match=r"reaches sample \d+ of the path .* outside its limits only, 'j1' being"
    ):
        plan(arm, task, settings=FEW)
    off = task_path(arm, goals[5:], dt=1.0, rows="position")
    with pytest.raises(InputError, match=r"outside its limits .* start within"):
        plan(arm, off, np.array([1.0, 0.0, 0.0]))
