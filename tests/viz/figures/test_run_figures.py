import subprocess
import sys

import numpy as np
import pytest

from ftqp.control.paths import Circle, Square
from ftqp.control.planner.planner import Planner
from ftqp.core.errors import InputError
from ftqp.core.extras import remedy_for_extra
from ftqp.faults.kinds import Degraded, FreeSwinging, Locked
from ftqp.model import catalog
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_file import load_log
from ftqp.sim.loop import Simulation
from ftqp.sim.plants.plant import Arm
from ftqp.sim.schedule import FaultEvent, Schedule
from ftqp.sim.sensors.joint_sensors import JointSensors, Offset

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')

from ftqp.viz.figures import canvas
from ftqp.viz.figures import error_figures as errors
from ftqp.viz.figures import joint_figures as joints
from ftqp.viz.figures import status_ribbon as ribbon
from ftqp.viz.figures.run_figures import DRAWINGS, save_figures


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="module")
def panda_log(folder):
    panda = catalog.load("panda")
    path = Circle(Arm(panda).tip(panda.neutral).copy(), 0.05, duration=2.0, axes=("y", "z"))
    schedule = Schedule(
        [
            FaultEvent(1.0, Locked("panda_joint3"), 1.2),
            FaultEvent(0.5, Degraded("panda_joint4", velocity=0.5, torque=0.4, q_max=-0.5)),
            FaultEvent(1.8, FreeSwinging("panda_joint7", damping=1.0), "never"),
            FaultEvent(9.0, Locked("panda_joint1")),
        ]
    )
    file = folder / "panda.npy"
    Simulation(Planner(panda, dt=0.01), path, q=panda.neutral, schedule=schedule, log=file).run()
    return load_log(file)


@pytest.fixture(scope="module")
def stopped_log(folder):
    planar = catalog.load("planar6")
    q = np.full(6, np.pi / 12)
    path = Square(Arm(planar).tip(q).copy(), 0.3, duration=4.0)
    schedule = Schedule([FaultEvent(1.0, Locked(i)) for i in range(5)])
    file = folder / "planar.npy"
    Simulation(Planner(planar, dt=0.01), path, q=q, schedule=schedule, log=file).run()
    return load_log(file)


@pytest.fixture(scope="module")
def measured_log():
    panda = catalog.load("panda")
    path = Circle(Arm(panda).tip(panda.neutral).copy(), 0.05, duration=1.0)
    sensors = JointSensors(panda, 0.01, faults=[Offset(joint=1, at=0.5, samples=1, size=0.01)])
    return Simulation(Planner(panda, dt=0.01), path, q=panda.neutral, sensors=sensors, log="memory").run().log


@pytest.fixture
def drawn(monkeypatch):
    """The figures that are saved, to look inside."""
    figures = []

    def keep(figure, path):
        figures.append(figure)
        return canvas.save(figure, path)

    for module in (joints, ribbon, errors):
        monkeypatch.setattr(module, "save", keep)
    return figures


def texts(figure):
    """All words of a figure."""
    found = [figure.get_suptitle(), *(text.get_text() for text in figure.texts)]
    for legend in figure.legends:
        found += [text.get_text() for text in legend.get_texts()]
    for axes in figure.axes:
        found += [axes.get_title(loc) for loc in ("left", "center", "right")]
        found += [axes.get_xlabel(), axes.get_ylabel()]
        found += [text.get_text() for text in axes.texts]
        found += [label.get_text() for label in axes.get_yticklabels()]
        if axes.get_legend():
            found += [text.get_text() for text in axes.get_legend().get_texts()]
    return "\n".join(found)


@pytest.mark.parametrize("name", ["panda_log", "stopped_log"])
def test_every_picture_is_written(request, tmp_path, name):
    files = save_figures(request.getfixturevalue(name), tmp_path / "figures")
    left_out = ("base.png", "following.png", "tasks.png")
    assert [file.name for file in files] == [name for name in DRAWINGS if name not in left_out]


def test_run_with_sensors_has_a_picture_of_what_was_sent_and_measured(measured_log, drawn, tmp_path):
    files = save_figures(measured_log, tmp_path / "figures")
    assert "following.png" in [file.name for file in files]
    joints.draw_following(measured_log, tmp_path / "a.png")
    words = texts(drawn[-1])
    for expected in ("distance [µrad]", "true position, working joint", "measured position"):
        assert expected in words
    joints.draw_positions(measured_log, tmp_path / "b.png")
    assert "sent to the arm" in texts(drawn[-1])


def test_path_figure_names_units_faults_and_errors(panda_log, drawn, tmp_path):
    errors.draw_path(panda_log, tmp_path / "a.png")
    words = texts(drawn[0])
    names = "panda|mvn scheme|desired|actual|the target [mm]|the target [deg]|time [s]"
    instants = "panda_joint3 fails (1 s)|planner is told|emergency stop above this"
    for expected in f"{names}|{instants}".split("|"):
        assert expected in words
    assert "panda_joint1" not in words


def test_no_legend_hides_a_path(panda_log, stopped_log, drawn, tmp_path):
    for log in (panda_log, stopped_log):
        errors.draw_path(log, tmp_path / "a.png")
    for figure in drawn:
        assert not [axes for axes in figure.axes if axes.get_legend()]
        below = figure.legends[0].get_window_extent()
        assert below.y1 <= min(axes.get_window_extent().y0 for axes in figure.axes)


def test_joint_figure_shows_every_joint_within_its_limits(panda_log, drawn, tmp_path):
    joints.draw_positions(panda_log, tmp_path / "a.png")
    words = texts(drawn[0])
    assert "position [deg]" in words
    assert "panda_joint2" in words
    assert "panda_joint3: locked from 1 s" in words
    assert "panda_joint4: degraded from 0.5 s" in words
    panel = drawn[0].axes[1]
    bottom, top = panel.get_ylim()
    moved = np.degrees(panda_log["q.panda_joint2"])
    assert bottom < moved.min() < moved.max() < top
    assert top - bottom < 2.0 * max(np.ptp(moved), 6.1), "3 % of the range, or the motion with some room"
    assert [text.get_text() for text in panel.texts] == ["−101", "101"], "the limits beside the bar"
    np.testing.assert_allclose(
        panel.lines[0].get_ydata(), np.degrees(panda_log["q.panda_joint2"]), atol=1e-12
    )


def test_torque_at_the_brake_takes_the_place_of_that_of_the_motor(panda_log, drawn, tmp_path):
    joints.draw_torques(panda_log, tmp_path / "a.png")
    panel = drawn[0].axes[2]
    (carried,) = [line for line in panel.lines if line.get_color() == canvas.WINE]
    told = panda_log["t"] >= 1.2 - 1e-9
    np.testing.assert_allclose(carried.get_ydata()[told], panda_log["tau_brake.panda_joint3"][told])
    assert np.isnan(carried.get_ydata()[~told]).all()


def test_path_figure_draws_the_arm_at_five_instants_with_its_failed_joint(panda_log, drawn, tmp_path):
    errors.draw_path(panda_log, tmp_path / "a.png")
    words = texts(drawn[0])
    assert "The arm from the side" in words and "The arm from above" in words
    assert "arm at 0, 0.5, " in words and "failed joint" in words
    side = next(axes for axes in drawn[0].axes if "from the side" in axes.get_title())
    arms = [line for line in side.lines if len(line.get_xdata()) == 9]
    assert len(arms) == 5
    last = panda_log["tip"][-1, [0, 2]]
    assert np.allclose([arms[-1].get_xdata()[-1], arms[-1].get_ydata()[-1]], 1e3 * last, atol=0.01)


def test_ribbon_tells_truth_from_belief(panda_log, drawn, tmp_path):
    ribbon.draw(panda_log, tmp_path / "a.png")
    words = texts(drawn[0])
    assert "panda_joint3, really" in words
    assert "panda_joint3, as the planner believes" in words
    assert "panda_joint4, really and as believed" in words
    assert "OK: the task is followed and every limit is kept" in words


def test_arm_without_inertia_has_no_torque_figure(panda_log, tmp_path):
    blank = {name: np.array(panda_log[name]) for name in panda_log.names}
    for name in blank:
        if name.startswith("tau."):
            blank[name][:] = np.nan
    log = Log(panda_log.path, blank, panda_log.units, panda_log.descriptions, panda_log.metadata)
    assert [file.name for file in save_figures(log, tmp_path)] == [
        "path.png", "joints.png", "velocities.png", "status.png"
    ]  # fmt: skip


def test_empty_log_and_bad_folder_are_clear_sentences(panda_log, tmp_path):
    none = {name: np.array(panda_log[name][:0]) for name in panda_log.names}
    log = Log(panda_log.path, none, panda_log.units, panda_log.descriptions, panda_log.metadata)
    with pytest.raises(InputError, match="has no rows"):
        save_figures(log, tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be made"):
        save_figures(panda_log, tmp_path / "file" / "figures")
    with pytest.raises(InputError, match="cannot be written"):
        ribbon.draw(panda_log, tmp_path / "none" / "status.png")


def test_missing_matplotlib_says_how_to_install_it():
    script = (
        "import sys; sys.modules['matplotlib.axes'] = None\n"
        "from ftqp.core.errors import MissingPackage\n"
        "try:\n    import ftqp.viz.figures.run_figures\nexcept MissingPackage as error:\n    print(error)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert "matplotlib" in done.stdout
    assert remedy_for_extra("viz") in done.stdout
