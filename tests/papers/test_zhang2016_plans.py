"""Zhang et al. 2016: the sweep of self-motion speeds, and what stronger plans survive on the same paths.

The tables in full are made by ``python studies/zhang2016.py``; here grids are coarser.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tests.papers.zhang2016 import ARM, Q0, example

from ftqp.analysis.planning.nodes import curve_nodes
from ftqp.analysis.planning.plan_case import PlanSettings, planning_study
from ftqp.analysis.planning.planned import plan
from ftqp.analysis.planning.survival_labels import survivals
from ftqp.analysis.survival.continuing import tracks
from ftqp.analysis.survival.task_path import task_path
from ftqp.control.paths import Line
from ftqp.model import catalog

THETAS = (-0.18, -0.10, 0.0, 0.02, 0.06, 0.10, 0.14, 0.18, 0.25, 0.5, 1.0, -1.0)
COVERAGE = (0.649, 0.689, 0.676, 0.696, 0.791, 0.831, 0.811, 0.807, 0.561, 0.244, 0.13, 0.11)
ENERGY = (1.05, 0.670, 0.496, 0.481, 0.514, 0.630, 0.817, 1.07, 1.64, 5.32, 20.4, 20.4)
COARSE = PlanSettings(waypoints=40, spacing=0.1, thetas=tuple(np.linspace(-1.0, 1.0, 41)))
DOWN = np.diag([1.0, -1.0, -1.0, 1.0])
USUAL = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])


@cache
def planar_task():
    arm = catalog.load("planar", lengths=(1, 1, 1), continuous=True)
    q0 = np.array([-1.524418, 1.260809, 0.741032])
    start = arm.pose(q0)
    return task_path(
        arm, Line(start, np.array([0.5, 1.2, 0.0]) - start[:3, 3], duration=10.0), dt=0.1, rows="position"
    ), q0


@cache
def panda_task(position, way):
    """A line of the Panda with its tool down, and the usual posture moved onto its start."""
    arm, start = catalog.load("panda"), DOWN.copy()
    start[:3, 3] = position
    task = task_path(arm, Line(start, way, duration=6.0), dt=0.025)
    nodes = curve_nodes(planning_study(task, 0.06), task.goals[:1], spacing=0.06, seed=0)[0]
    return task, nodes[np.argmin(np.linalg.norm(nodes - USUAL, axis=1))]


Y_LINE = (0.45, -0.2, 0.35), (0.0, 0.4, 0.0)


def test_sweep_of_self_motion_speeds_is_that_of_the_table() -> None:
    task = example(0.05)
    q, last = tracks(task, np.tile(Q0, (len(THETAS), 1)), np.array(THETAS)[:, None])
    assert (last == task.N).all()
    found = survivals(task, q, 4)
    assert np.abs(found.coverage - COVERAGE).max() <= 0.01
    energy = (np.diff(q, axis=1) ** 2).sum(axis=(1, 2)) / task.dt
    assert energy == pytest.approx(ENERGY, rel=0.01)
    inside = np.abs(THETAS) <= 0.18
    assert ((found.excess <= 1e-9) == inside).all()


@pytest.mark.slow
def test_speed_of_most_coverage_is_a_tenth_and_that_of_the_rule_in_print_nearly_nothing() -> None:
    thetas = tuple(np.round(np.arange(-0.3, 0.301, 0.02), 2))
    task = example(0.05)
    best = plan(ARM, task, Q0, "constant", settings=PlanSettings(thetas=thetas))
    assert best.settings["theta"] == pytest.approx(0.10) and best.coverage == pytest.approx(0.831, abs=0.01)
    rule = plan(ARM, task, Q0, "constant", settings=PlanSettings(thetas=thetas, select="energy"))
    assert rule.settings["theta"] == pytest.approx(0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings", "fixed", "free"),
    [
        ("planar", replace(COARSE, waypoints=100, spacing=0.06), 0.900, 1.000),
        ("zhang7", COARSE, 0.860, 0.860),
        ("panda", COARSE, 0.955, 0.971),
    ],
)
def test_dynamic_programming_beats_the_best_constant_speed_and_a_free_start_a_given_one(
    name: str, settings: PlanSettings, fixed: float, free: float
) -> None:
    task, q0 = {
        "planar": planar_task,
        "zhang7": lambda: (example(0.05), Q0),
        "panda": lambda: panda_task(*Y_LINE),
    }[name]()
    constant, given, open_start = (
        plan(task.robot, task, start, method, settings=settings).coverage
        for start, method in ((q0, "constant"), (q0, "dp"), (None, "dp"))
    )
    assert given >= constant - 0.005 and open_start >= given - 0.005
    assert given == pytest.approx(fixed, abs=0.02) and open_start == pytest.approx(free, abs=0.02)


@pytest.mark.slow
def test_share_of_the_path_that_can_be_made_safe_is_found_with_a_free_start() -> None:
    task = example(0.05, share=0.4)
    made = plan(ARM, task, settings=COARSE)
    assert made.coverage == 1.0 and min(made.settings["bound"]) == 7


@pytest.mark.slow
def test_half_the_step_and_half_the_spacing_change_little() -> None:
    task, _ = panda_task(*Y_LINE)
    coarse = plan(task.robot, task, settings=PlanSettings(waypoints=40, spacing=0.1))
    fine = plan(task.robot, task, settings=PlanSettings(waypoints=80, spacing=0.05))
    assert abs(fine.coverage - coarse.coverage) < 0.02


@pytest.mark.slow
def test_elbow_of_an_arm_with_spherical_shoulder_and_wrist_is_lost_with_every_plan() -> None:
    arm = catalog.load("iiwa14")
    start = arm.pose(np.deg2rad([0.0, 30.0, 0.0, -80.0, 0.0, 60.0, 0.0]))
    task = task_path(arm, Line(start, (0.05, 0.0, 0.0), duration=4.0), dt=0.1)
    few = PlanSettings(waypoints=20, spacing=0.2, thetas=(-0.1, 0.0, 0.1), evaluations=10)
    for method in ("dp", "constant", "spline"):
        made = plan(arm, task, None, method, settings=few)
        assert made.coverage == pytest.approx(6 / 7, abs=1e-9)
        assert "bound" not in made.settings or max(made.settings["bound"]) == 6
