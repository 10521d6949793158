"""Runs side by side: what the pictures show and say."""

from pathlib import Path

import numpy as np
import pytest

from ftqp.control.paths import Square
from ftqp.control.planner.planner import Planner
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Locked
from ftqp.model import catalog
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_file import load_log
from ftqp.sim.loop import Simulation
from ftqp.sim.plants.plant import Arm
from ftqp.sim.schedule import FaultEvent, Schedule

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')

from ftqp.viz.figures import canvas, events
from ftqp.viz.figures import compared_runs as comparison

KINDS = ["errors", "velocities", "accelerations", "torques", "status"]


def planar_log(file: Path, scheme: str, *, failing: int = 1) -> Log:
    """A square of the planar arm that is too fast for it when five joints lock."""
    robot = catalog.load("planar6")
    q = np.full(6, np.pi / 12)
    path = Square(Arm(robot).tip(q).copy(), 0.05 if failing == 1 else 0.3, duration=4.0)
    schedule = Schedule([FaultEvent(1.0, Locked(i)) for i in range(failing)])
    Simulation(Planner(robot, dt=0.01, scheme=scheme), path, q=q, schedule=schedule, log=file).run()
    return load_log(file)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Log]:
    """Two runs that coincide, one that does not, one that stops."""
    folder = tmp_path_factory.mktemp("runs")
    first = planar_log(folder / "a.npy", "mvn")
    other = planar_log(folder / "b.npy", "mtn")
    stopped = planar_log(folder / "c.npy", "mvn", failing=5)
    return {"one": first, "same": first, "mtn": other, "stops": stopped}


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[canvas.Figure]:
    """The figures that are saved, to look inside."""
    figures: list[canvas.Figure] = []

    def keep(figure: canvas.Figure, path: Path) -> Path:
        figures.append(figure)
        return canvas.save(figure, path)

    monkeypatch.setattr(comparison, "save", keep)
    return figures


def legend(figure: canvas.Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_five_pictures_are_written(logs: dict[str, Log], tmp_path: Path) -> None:
    files = comparison.save_comparison(logs, tmp_path / "new" / "figures", name="square", title="the square")
    assert [file.name for file in files] == [f"square-{kind}.png" for kind in KINDS]
    assert sorted(file.name for file in files[0].parent.iterdir()) == sorted(file.name for file in files)


def test_errors_of_all_runs_share_one_logarithmic_panel(
    logs: dict[str, Log], drawn: list[canvas.Figure], tmp_path: Path
) -> None:
    comparison.draw_errors(logs, "the square", tmp_path / "a.png")
    (axes,) = drawn[0].axes
    assert axes.get_yscale() == "log"
    assert axes.get_ylabel() == "position error [mm]"
    words = legend(drawn[0])
    assert words[2] == f"mtn, largest {events.length(logs['mtn']['position_error'].max())}"
    stop = logs["stops"]["t"][np.argmax(logs["stops"]["status"] >= 4)]
    assert words[3].endswith(f"stopped at {stop:.4g} s")
    np.testing.assert_allclose(axes.lines[2].get_ydata()[-50:], 1e3 * logs["mtn"]["position_error"][-50:])


def test_a_curve_hidden_by_another_is_wider_than_it(
    logs: dict[str, Log], drawn: list[canvas.Figure], tmp_path: Path
) -> None:
    comparison.draw_errors({key: logs[key] for key in ("one", "same", "mtn")}, "x", tmp_path / "a.png")
    (axes,) = drawn[0].axes
    one, same, mtn = (line.get_linewidth() for line in axes.lines[:3])
    assert one > same == mtn
    assert "coincide" in axes.get_title(loc="right")


def test_every_run_has_a_panel_of_velocities_with_the_same_axes(
    logs: dict[str, Log], drawn: list[canvas.Figure], tmp_path: Path
) -> None:
    comparison.draw_velocities(logs, "the square", tmp_path / "a.png")
    panels = [axes for axes in drawn[0].axes if axes.lines]
    assert [axes.get_title().split(":")[0] for axes in panels] == list(logs)
    assert len({axes.get_ylim() for axes in panels}) == 1
    assert len({axes.get_xlim() for axes in panels}) == 1
    assert panels[0].get_ylabel() == "velocity [deg/s]"
    np.testing.assert_allclose(panels[2].lines[3].get_ydata(), np.degrees(logs["mtn"]["v"][:, 3]))
    assert legend(drawn[0])[:6] == [f"j{i}" for i in range(1, 7)]


def test_agreement_shows_error_difference_and_times(
    logs: dict[str, Log], drawn: list[canvas.Figure], tmp_path: Path
) -> None:
    comparison.draw_agreement(logs, tmp_path / "a.png", reference="one", title="t", tolerance=1e-6)
    error, difference, times = drawn[0].axes
    assert error.get_ylabel() == "position error [mm]"
    assert "to one so far [rad]" in difference.get_ylabel()
    worst = np.abs(logs["mtn"]["q"] - logs["one"]["q"]).max()
    assert difference.lines[1].get_ydata()[-1] == worst
    assert [label.get_text() for label in times.get_yticklabels()] == list(logs)
    assert times.get_xlabel() == "time of a step [us]"


def test_unknown_reference_names_the_runs(logs: dict[str, Log], tmp_path: Path) -> None:
    with pytest.raises(InputError, match="it has one, same, mtn, stops"):
        comparison.draw_agreement(logs, tmp_path / "a.png", reference="on", title="t")


def test_it_is_marked_when_a_detector_finds_out_and_not_said_who_was_told_where_runs_differ(
    logs: dict[str, Log], tmp_path: Path, drawn: list[canvas.Figure]
) -> None:
    one = logs["one"]
    fault = dict(one.metadata["faults"][0])
    runs = {}
    for label, announced, found in (("told", fault["at"], None), ("finds", None, [{"detected_at": 1.25}])):
        about = one.metadata | {"faults": [fault | {"announced": announced}], "detections": found}
        signals = {name: one[name] for name in one.names}
        runs[label] = Log(None, signals, one.units, one.descriptions, about)
    comparison.draw_errors(runs, "both", tmp_path / "errors.png")
    said = [text.get_text() for text in drawn[0].legends[0].get_texts()]
    assert "detector finds out at 1.25 s" in said
    assert not any("never told" in text for text in said)
    lines = [line for line in drawn[0].axes[0].lines if set(np.asarray(line.get_xdata())) == {1.25}]
    assert len(lines) == 1
