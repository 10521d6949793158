"""The figures of soft tasks, kept points and moving bases, and their rows in a report."""

import numpy as np
import pytest

import ftqp
from ftqp import InertialTask, MovingBase
from ftqp.control.paths import Hold
from ftqp.sim.base.disturbances import Step
from ftqp.sim.base.moving_world import MovingWorld, Platform
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.metrics import summary
from ftqp.sim.loop import Simulation

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')

from ftqp.viz.figures import error_figures as errors
from ftqp.viz.figures.canvas import Figure
from ftqp.viz.figures.run_figures import drawings_of, save_figures
from ftqp.viz.report.numbers import numbers

PANDA = ftqp.robots.load("panda")


def run(**settings):
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.05, duration=2.0)
    return Simulation(ftqp.Planner(PANDA, **settings), path, q=PANDA.neutral, log="memory").run().log


@pytest.fixture(scope="module")
def log():
    tasks = [
        ftqp.PositionTask("panda_joint4", rows="z", target=(0, 0, 0.6), name="elbow"),
        ftqp.AxisTask(PANDA.tip, towards=(0.6, 0.1, 0.0), name="look"),
    ]
    return run(tasks=tasks, constraints=[ftqp.Keep(PANDA.tip, above=(0, 0, 0.47), name="table")])


def test_each_unit_and_the_distances_have_a_panel(log, tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, file, **_: (drawn.append(figure), file.touch()))
    assert drawings_of(log)["tasks.png"] is errors.draw_further
    errors.draw_further(log, tmp_path / "tasks.png")
    titles = [axes.get_title() for axes in drawn[0].axes]
    assert titles[0].startswith("Errors of soft tasks [mm]: largest") and titles[0].endswith("(elbow)")
    assert titles[1].startswith("Errors of soft tasks [deg]: largest") and titles[1].endswith("(look)")
    assert titles[2].startswith("Distances of points from their boundaries [mm]: smallest")
    assert [text.get_text() for text in drawn[0].legends[0].get_texts()] == ["elbow", "look", "table"]
    for axes, group, factor in zip(drawn[0].axes, ("elbow", "look"), (1e3, 180.0 / np.pi), strict=False):
        assert axes.lines[0].get_ydata().max() == pytest.approx(factor * log[f"task_error.{group}"].max())
    assert list(drawn[0].axes[2].lines[0].get_ydata()) == [0.0, 0.0]
    assert drawn[0].axes[2].get_ylim()[0] < 0.0


def test_runs_without_them_have_neither_figure_nor_rows(log):
    plain = run()
    assert "tasks.png" not in drawings_of(plain) and errors.further_panels(plain) == []
    both = {"with": log, "without": plain}
    page = numbers({name: summary(one) for name, one in both.items()}, both)
    assert "elbow: largest error" in page and "look: error at the end" in page
    assert "table: smallest distance from its plane" in page
    alone = numbers({"without": summary(plain)}, {"without": plain})
    assert "elbow" not in alone and "plane" not in alone


def test_a_point_beyond_its_plane_and_unknown_numbers_are_told_apart(log):
    facts = summary(log) | {
        "tasks": {"elbow": {"final_error": None, "max_error": None, "unit": "m"}},
        "constraints": {"table": {"min_distance": -0.002}},
    }
    page = numbers({"run": facts}, {"run": log})
    assert "2 mm beyond it" in page and "elbow" not in page


@pytest.fixture(scope="module")
def moving_log(tmp_path_factory):
    robot = ftqp.robots.load("srs7")
    planner = ftqp.Planner(robot, 0.01, level="velocity", emergency=None)
    world = MovingWorld(
        InertialTask(planner, MovingBase()), Platform(), [Step("rotation", 0.3, at=0.2, rate=2.0)]
    )
    path = Hold(world.start() @ robot.pose(robot.neutral), duration=1.0)
    file = tmp_path_factory.mktemp("runs") / "log.npy"
    Simulation(planner, path, q=robot.neutral, world=world, log=file).run()
    return load_log(file)


def test_every_axis_has_its_panel_with_extremes_and_unit(moving_log, monkeypatch, tmp_path):
    kept = []
    monkeypatch.setattr(errors, "save", lambda figure, path: kept.append(figure) or path)
    errors.draw_base(moving_log, tmp_path / "base.png")
    axes = kept[0].axes
    titles = [a.get_title() for a in axes]
    assert len(axes) == 8
    worst = 1e3 * moving_log["inertial_error"][:, 1].min()
    assert f"Y error: {worst:+.3g} to" in titles[2] and titles[2].endswith("mm")
    assert titles[5].startswith("rotation error about Z") and titles[5].endswith("deg")
    assert titles[6:] == ["disturbance: base position", "disturbance: base rotation"]
    assert axes[6].texts[0].get_text() == "none"
    drawn = axes[7].lines[0].get_ydata()
    np.testing.assert_allclose(drawn, np.rad2deg(moving_log["disturbance.rotation"]))
    assert len({a.get_ylim() for a in axes[0:6:2]}) == 1
    assert [text.get_text() for text in kept[0].legends[0].get_texts()] == ["saturated"]


def test_base_figure_is_among_those_of_a_run(moving_log, tmp_path):
    assert "base.png" in [file.name for file in save_figures(moving_log, tmp_path / "figures")]
