import subprocess
import sys

import numpy as np
import pytest

from ftqp.control.paths import Circle, Line, Square
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.status import STATUSES
from ftqp.core.errors import InputError
from ftqp.core.extras import remedy_for_extra
from ftqp.faults.kinds import Degraded, FreeSwinging, Locked
from ftqp.model import catalog
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_file import load_log
from ftqp.sim.loop import Simulation
from ftqp.sim.plants.arm_model import Arm
from ftqp.sim.plants.servo_plant import ServoPlant
from ftqp.sim.schedule import FaultEvent, Schedule
from ftqp.sim.sensors.joint_sensors import JointSensors
from ftqp.sim.sensors.sensor_faults import Offset

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')

from ftqp.viz.figures import canvas, events, palette, tracking
from ftqp.viz.figures import joint_figures as joints
from ftqp.viz.figures import status_ribbon as ribbon
from ftqp.viz.figures.run_figures import DRAWINGS, save_figures

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="module")
def panda_log(folder):
    panda = catalog.load("panda")
    path = Circle(Arm(panda).tip(panda.neutral).copy(), 0.05, duration=2.0, axes=("y", "z"))
    schedule = Schedule(
        [
            FaultEvent(Locked("panda_joint3"), 1.0, 1.2),
            FaultEvent(Degraded("panda_joint4", velocity=0.5, torque=0.4, q_max=-0.5), 0.5),
            FaultEvent(FreeSwinging("panda_joint7", damping=1.0), 1.8, "never"),
            FaultEvent(Locked("panda_joint1"), 9.0),
        ]
    )
    file = folder / "panda.sqlite"
    Simulation(Planner(panda, dt=0.01), path, q=panda.neutral, schedule=schedule, log=file).run()
    return load_log(file)


@pytest.fixture(scope="module")
def stopped_log(folder):
    planar = catalog.load("planar6")
    q = np.full(6, np.pi / 12)
    path = Square(Arm(planar).tip(q).copy(), 0.3, duration=4.0)
    schedule = Schedule([FaultEvent(Locked(i), 1.0) for i in range(5)])
    file = folder / "planar.sqlite"
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

    for module in (joints, ribbon, tracking):
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
    left_out = ("base.png", "following.png")
    assert [file.name for file in files] == [name for name in DRAWINGS if name not in left_out]
    for file in files:
        content = file.read_bytes()
        assert content.startswith(PNG)
        assert len(content) > 10_000


def test_run_with_sensors_has_a_picture_of_what_was_sent_and_measured(measured_log, drawn, tmp_path):
    files = save_figures(measured_log, tmp_path / "figures")
    assert "following.png" in [file.name for file in files]
    joints.draw_following(measured_log, tmp_path / "a.png")
    words = texts(drawn[-1])
    for expected in ("distance [µrad]", "true position, working joint", "measured position"):
        assert expected in words
    joints.draw_positions(measured_log, tmp_path / "b.png")
    assert "sent to the arm" in texts(drawn[-1])


def test_following_error_of_an_arm_with_servos_is_drawn_in_thousandths(drawn, tmp_path):
    panda = catalog.load("panda")
    path = Circle(panda.pose(panda.neutral), 0.05, duration=1.0)
    plant = ServoPlant(panda, 0.01, drive="position", takes_velocity=False, time_constant=0.03)
    log = Simulation(Planner(panda, dt=0.01), path, q=panda.neutral, plant=plant, log="memory").run().log
    joints.draw_following(log, tmp_path / "a.png")
    assert "distance [mrad]" in texts(drawn[-1])


def test_path_figure_names_units_faults_and_errors(panda_log, drawn, tmp_path):
    tracking.draw(panda_log, tmp_path / "a.png")
    words = texts(drawn[0])
    names = "panda|mvn scheme|desired|actual|the target [mm]|the target [deg]|time [s]"
    instants = "panda_joint3 fails (1 s)|planner is told|emergency stop above this"
    for expected in f"{names}|{instants}".split("|"):
        assert expected in words
    assert "panda_joint1" not in words


def test_errors_are_drawn_on_a_logarithmic_axis(panda_log, drawn, tmp_path):
    tracking.draw(panda_log, tmp_path / "a.png")
    assert [axes.get_yscale() for axes in drawn[0].axes[1:3]] == ["log", "log"]


def test_line_that_the_tip_leaves_is_drawn_in_the_plane_of_both(drawn, tmp_path):
    panda = catalog.load("panda")
    line = Line(panda.pose(panda.neutral), (0.05, 0.0, 0.0), duration=1.0)
    run = Simulation(Planner(panda, dt=0.01), line, q=panda.neutral, log="memory").run().log
    bent = {name: np.array(run[name]) for name in run.names}
    bent["tip.z"] = bent["tip.z"] - np.linspace(0.0, 0.01, len(run))
    tracking.draw(Log(run.path, bent, run.units, run.descriptions, run.metadata), tmp_path / "a.png")
    assert "Path in the x-z plane" in texts(drawn[0])


def test_flat_path_is_drawn_in_its_plane(stopped_log, drawn, tmp_path):
    tracking.draw(stopped_log, tmp_path / "a.png")
    assert "Path in the x-y plane" in texts(drawn[0])
    assert "5 joints fail (1 s)" in texts(drawn[0])


def test_path_in_space_is_drawn_in_space(panda_log, drawn, tmp_path):
    bent = {name: np.array(panda_log[name]) for name in panda_log.names}
    bent["tip.x"] = bent["tip.x"] + np.linspace(0.0, 0.1, len(panda_log))
    log = Log(panda_log.path, bent, panda_log.units, panda_log.descriptions, panda_log.metadata)
    tracking.draw(log, tmp_path / "a.png")
    assert drawn[0].axes[0].name == "3d"


def test_no_legend_hides_a_path(panda_log, stopped_log, drawn, tmp_path):
    for log in (panda_log, stopped_log):
        tracking.draw(log, tmp_path / "a.png")
    for figure in drawn:
        assert not [axes for axes in figure.axes if axes.get_legend()]
        below = figure.legends[0].get_window_extent()
        assert below.y1 <= min(axes.get_window_extent().y0 for axes in figure.axes)


def test_stop_is_marked(stopped_log, drawn, tmp_path):
    stop = events.stop_time(stopped_log)
    assert stop is not None
    tracking.draw(stopped_log, tmp_path / "a.png")
    assert f"emergency stop at {stop:.4g} s" in texts(drawn[0])


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


def test_torque_figure_shows_brake_and_limits(panda_log, drawn, tmp_path):
    joints.draw_torques(panda_log, tmp_path / "a.png")
    words = texts(drawn[0])
    assert "torque [N m]" in words
    assert "carried by the brake" in words
    assert "panda_joint3: brake carries" in words


def test_torque_at_the_brake_takes_the_place_of_that_of_the_motor(panda_log, drawn, tmp_path):
    joints.draw_torques(panda_log, tmp_path / "a.png")
    panel = drawn[0].axes[2]
    (carried,) = [line for line in panel.lines if line.get_color() == palette.WINE]
    told = panda_log["t"] >= 1.2 - 1e-9
    np.testing.assert_allclose(carried.get_ydata()[told], panda_log["tau_brake.panda_joint3"][told])
    assert np.isnan(carried.get_ydata()[~told]).all()


def test_velocity_figure_shows_a_limit_only_where_a_joint_comes_near_it(panda_log, drawn, tmp_path):
    fast = {name: np.array(panda_log[name]) for name in panda_log.names}
    fast["v.panda_joint6"] = np.linspace(0.0, 2.5, len(panda_log))
    log = Log(panda_log.path, fast, panda_log.units, panda_log.descriptions, panda_log.metadata)
    joints.draw_velocities(log, tmp_path / "a.png")
    limit = np.degrees(panda_log.metadata["limits"]["v_max"][5])
    fast_panel, slow_panel = drawn[0].axes[5], drawn[0].axes[1]
    assert fast_panel.get_ylim()[1] > limit
    assert slow_panel.get_ylim()[1] < 0.5 * limit
    assert "velocity [deg/s]" in texts(drawn[0])


def test_arm_without_limits_of_torque_has_no_word_of_them(stopped_log, drawn, tmp_path):
    joints.draw_torques(stopped_log, tmp_path / "a.png")
    joints.draw_positions(stopped_log, tmp_path / "b.png")
    assert "limit" not in texts(drawn[0])
    assert "beyond the limit" in texts(drawn[1])


def test_path_figure_draws_the_arm_at_five_instants_with_its_failed_joint(panda_log, drawn, tmp_path):
    tracking.draw(panda_log, tmp_path / "a.png")
    words = texts(drawn[0])
    assert "The arm from the side" in words and "The arm from above" in words
    assert "arm at 0, 0.5, " in words and "failed joint" in words
    side = next(axes for axes in drawn[0].axes if "from the side" in axes.get_title())
    arms = [line for line in side.lines if len(line.get_xdata()) == 9]
    assert len(arms) == 5
    last = panda_log["tip"][-1, [0, 2]]
    assert np.allclose([arms[-1].get_xdata()[-1], arms[-1].get_ydata()[-1]], 1e3 * last, atol=0.01)


def test_log_that_does_not_know_its_arm_is_drawn_without_it(panda_log, drawn, tmp_path):
    about = {key: value for key, value in panda_log.metadata.items() if key != "skeleton"}
    signals = {name: panda_log[name] for name in panda_log.names}
    tracking.draw(Log(None, signals, panda_log.units, panda_log.descriptions, about), tmp_path / "a.png")
    assert "from above" not in texts(drawn[0])
    broken = about | {"skeleton": {"prismatic": [False], "placements": [[1.0]], "tip": []}}
    log = Log(None, signals, panda_log.units, panda_log.descriptions, broken)
    with pytest.raises(InputError, match="the arm's geometry"):
        tracking.draw(log, tmp_path / "b.png")


def test_ribbon_tells_truth_from_belief(panda_log, drawn, tmp_path):
    ribbon.draw(panda_log, tmp_path / "a.png")
    words = texts(drawn[0])
    assert "panda_joint3, really" in words
    assert "panda_joint3, as the planner believes" in words
    assert "panda_joint4, really and as believed" in words
    assert "OK: the task is followed and every limit is kept" in words


def test_no_word_of_the_ribbon_leaves_the_picture(drawn, panda_log, tmp_path):
    signals = {name: np.array(panda_log[name]) for name in panda_log.names}
    signals["status"] = np.arange(len(panda_log)) % len(STATUSES)
    log = Log(None, signals, panda_log.units, panda_log.descriptions, panda_log.metadata)
    ribbon.draw(log, tmp_path / "a.png")
    (figure,) = drawn
    for legend in (*figure.legends, figure.axes[0].get_legend()):
        place = legend.get_window_extent()
        assert place.x0 >= 0.0 and place.x1 <= figure.bbox.width
        assert place.y0 >= 0.0 and place.y1 <= figure.bbox.height
        assert figure._suptitle.get_window_extent().y0 >= place.y1


def test_ribbon_shows_every_spell(stopped_log, drawn, tmp_path):
    ribbon.draw(stopped_log, tmp_path / "a.png")
    spells = 1 + np.count_nonzero(np.diff(stopped_log["status"]))
    assert len(drawn[0].axes[0].collections) == spells + 5 * 2


def test_log_of_one_row_can_be_drawn(panda_log, tmp_path):
    first = {name: np.array(panda_log[name][:1]) for name in panda_log.names}
    log = Log(panda_log.path, first, panda_log.units, panda_log.descriptions, panda_log.metadata)
    assert len(save_figures(log, tmp_path)) == 5


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


def test_drawing_leaves_no_global_state():
    script = "import sys; import ftqp.viz.figures.run_figures; print('matplotlib.pyplot' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
