"""The picture of a run beside rivals: its legend says what its curves show."""

import numpy as np

import ftqp
from ftqp.viz.figures import rivals
from ftqp.viz.figures.rivals import Rival, draw_rivals

PANDA = ftqp.robots.load("panda")


def test_the_legend_tells_the_errors_that_are_drawn(tmp_path, monkeypatch):
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.05, duration=0.5)
    planner = ftqp.Planner(PANDA, dt=5e-3)
    schedule = ftqp.Schedule([ftqp.FaultEvent(0.25, ftqp.Locked("panda_joint3"))])
    log = ftqp.Simulation(planner, path, q=PANDA.neutral, schedule=schedule, log="memory").run().log
    error = np.zeros(len(log))
    error[10], error[70], error[-1] = 0.5, 0.0123, 0.0045  # the first is before the lock
    labels: list[str] = []
    drawn = rivals.legend_below

    def kept(figure, handles):
        labels.extend(handle.get_label() for handle in handles)
        drawn(figure, handles)

    monkeypatch.setattr(rivals, "legend_below", kept)
    other = Rival(name="other", q=log["q"], tip=log["tip"][:, :3], error=error)
    file = draw_rivals(log, "own", [other], tmp_path / "rivals.png", "title")
    assert file.stat().st_size > 20_000
    assert "other: at most 12.3 mm off, 4.5 mm at the end" in labels
    assert any(label.startswith("own: at most ") for label in labels)
