"""The figure of soft tasks and kept points, and their rows in a report."""

import numpy as np
import pytest

import ftqp
from ftqp.sim.log.metrics import summary
from ftqp.sim.loop import Simulation

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')

from ftqp.viz.figures import further_errors as further
from ftqp.viz.figures.canvas import Figure
from ftqp.viz.figures.run_figures import drawings_of
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
    assert drawings_of(log)["tasks.png"] is further.draw
    further.draw(log, tmp_path / "tasks.png")
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
    assert "tasks.png" not in drawings_of(plain) and further.panels(plain) == []
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
