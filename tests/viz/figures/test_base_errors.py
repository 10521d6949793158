"""The figure of a run on a moving base shows errors per axis with units, the disturbance and the statuses."""

import numpy as np
import pytest

import ftqp
from ftqp import InertialTask, MovingBase
from ftqp.control.paths import Hold
from ftqp.sim.base.disturbances import Step
from ftqp.sim.base.moving_world import MovingWorld, Platform
from ftqp.sim.log.log_file import load_log
from ftqp.sim.loop import Simulation

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')

from ftqp.viz.figures import base_errors as base
from ftqp.viz.figures.run_figures import save_figures


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    robot = ftqp.robots.load("srs7")
    planner = ftqp.Planner(robot, 0.01, level="velocity", emergency=None)
    world = MovingWorld(
        InertialTask(planner, MovingBase()), Platform(), [Step("rotation", 0.3, at=0.2, rate=2.0)]
    )
    path = Hold(world.start() @ robot.pose(robot.neutral), duration=1.0)
    file = tmp_path_factory.mktemp("runs") / "log.npy"
    Simulation(planner, path, q=robot.neutral, world=world, log=file).run()
    return load_log(file)


def test_every_axis_has_its_panel_with_extremes_and_unit(log, monkeypatch, tmp_path):
    kept = []
    monkeypatch.setattr(base, "save", lambda figure, path: kept.append(figure) or path)
    base.draw(log, tmp_path / "base.png")
    axes = kept[0].axes
    titles = [a.get_title() for a in axes]
    assert len(axes) == 8
    worst = 1e3 * log["inertial_error"][:, 1].min()
    assert f"Y error: {worst:+.3g} to" in titles[2] and titles[2].endswith("mm")
    assert titles[5].startswith("rotation error about Z") and titles[5].endswith("deg")
    assert titles[6:] == ["disturbance: base position", "disturbance: base rotation"]
    assert axes[6].texts[0].get_text() == "none"
    drawn = axes[7].lines[0].get_ydata()
    np.testing.assert_allclose(drawn, np.rad2deg(log["disturbance.rotation"]))
    assert len({a.get_ylim() for a in axes[0:6:2]}) == 1
    assert [text.get_text() for text in kept[0].legends[0].get_texts()] == ["saturated"]


def test_base_figure_is_among_those_of_a_run(log, tmp_path):
    assert "base.png" in [file.name for file in save_figures(log, tmp_path / "figures")]
