"""Pictures of runs, alone and side by side, and of arms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.viz.figures.conftest import legend, words

import ftqp
from ftqp.control.paths import Circle, Hold, Square
from ftqp.control.planner.planner import Planner
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Degraded, FreeSwinging, Locked
from ftqp.sim.base.disturbances import Step
from ftqp.sim.base.moving_world import MovingWorld, Platform
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.loop import MEMORY, Simulation
from ftqp.sim.schedule import FaultEvent, Schedule
from ftqp.sim.sensors.joint_sensors import JointSensors, Offset
from ftqp.viz.figures import arm_picture, canvas, compared_runs, events, loop_picture
from ftqp.viz.figures import error_figures as errors
from ftqp.viz.figures import joint_figures as joints
from ftqp.viz.figures import run_figures as runs

PANDA = ftqp.robots.load("panda")
KINDS = ["errors", "velocities", "accelerations", "torques", "status"]


def run(planner, path, q=PANDA.neutral, **settings):
    return Simulation(planner, path, q=q, log=MEMORY, **settings).run().log


def changed(log, signals=(), **about):
    """A log with other signals or facts."""
    arrays = {name: np.array(log[name]) for name in log.names} | dict(signals)
    return Log(log.path, arrays, log.units, log.descriptions, log.metadata | about)


def panda_circle(duration=2.0):
    return Circle(PANDA.pose(PANDA.neutral), 0.05, duration=duration, axes=("y", "z"))


@pytest.fixture(scope="module")
def panda_log():
    schedule = Schedule(
        [
            FaultEvent(1.0, Locked("panda_joint3"), 1.2),
            FaultEvent(0.5, Degraded("panda_joint4", velocity=0.5, torque=0.4, q_max=-0.5)),
            FaultEvent(1.8, FreeSwinging("panda_joint7", damping=1.0), "never"),
            FaultEvent(9.0, Locked("panda_joint1")),
        ]
    )
    return run(Planner(PANDA, dt=0.01, detector=False), panda_circle(), schedule=schedule)


def planar_log(scheme, failing=1):
    """A square of the planar arm that is too fast for it when five joints lock."""
    robot, q = ftqp.robots.load("planar6"), np.full(6, np.pi / 12)
    path = Square(robot.pose(q), 0.05 if failing == 1 else 0.3, duration=4.0)
    schedule = Schedule([FaultEvent(1.0, Locked(i)) for i in range(failing)])
    return run(Planner(robot, dt=0.01, scheme=scheme), path, q, schedule=schedule)


@pytest.fixture(scope="module")
def logs():
    """Two runs that coincide, one that does not, one that stops."""
    first, other, stopped = planar_log("mvn"), planar_log("mtn"), planar_log("mvn", 5)
    return {"one": first, "same": first, "mtn": other, "stops": stopped}


def test_every_picture_of_a_run_is_written(panda_log, tmp_path):
    files = runs.save_figures(panda_log, tmp_path / "figures")
    left_out = ("base.png", "following.png", "tasks.png")
    assert [file.name for file in files] == [name for name in runs.DRAWINGS if name not in left_out]
    assert all(file.stat().st_size > 5000 for file in files)


def test_run_with_sensors_has_a_picture_of_what_was_sent_and_measured(drawn, tmp_path):
    sensors = JointSensors(PANDA, 0.01, faults=[Offset(joint=1, at=0.5, samples=1, size=0.01)])
    log = run(Planner(PANDA, dt=0.01), panda_circle(1.0), sensors=sensors)
    assert "following.png" in runs.drawings_of(log)
    joints.draw_following(log, tmp_path / "a.png")
    joints.draw_positions(log, tmp_path / "b.png")
    for expected in ("distance [µrad]", "true position, working joint", "measured position"):
        assert expected in words(drawn[0])
    assert "sent to the arm" in words(drawn[1])


def test_path_figure_names_units_faults_and_errors_and_draws_the_arm_five_times(panda_log, drawn, tmp_path):
    errors.draw_path(panda_log, tmp_path / "a.png")
    said = words(drawn[0])
    names = "panda|mvn scheme|desired|actual|the target [mm]|the target [deg]|time [s]|failed joint"
    instants = "panda_joint3 fails (1 s)|reported|emergency stop above this|arm at 0, 0.5, "
    for expected in f"{names}|{instants}|The arm from the side|The arm from above".split("|"):
        assert expected in said
    assert "panda_joint1" not in said
    side = next(axes for axes in drawn[0].axes if "from the side" in axes.get_title())
    arms = [line for line in side.lines if len(line.get_xdata()) == 9]
    assert len(arms) == 5
    last = panda_log["tip"][-1, [0, 2]]
    assert np.allclose([arms[-1].get_xdata()[-1], arms[-1].get_ydata()[-1]], 1e3 * last, atol=0.01)


def test_arm_without_inertia_has_no_torque_figure(panda_log):
    none = np.full(len(panda_log), np.nan)
    log = changed(panda_log, {name: none for name in panda_log.names if name.startswith("tau.")})
    assert list(runs.drawings_of(log)) == ["path.png", "joints.png", "velocities.png", "status.png"]


def test_empty_log_and_bad_folder_are_clear_sentences(panda_log, tmp_path):
    log = changed(panda_log, {name: panda_log[name][:0] for name in panda_log.names})
    with pytest.raises(InputError, match="has no rows"):
        runs.save_figures(log, tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be made"):
        runs.save_figures(panda_log, tmp_path / "file" / "figures")
    with pytest.raises(InputError, match="cannot be written"):
        runs.draw_statuses(panda_log, tmp_path / "none" / "status.png")


@pytest.fixture(scope="module")
def further_log():
    tasks = [
        ftqp.PositionTask("panda_joint4", rows="z", target=(0, 0, 0.6), name="elbow"),
        ftqp.AxisTask(PANDA.tip, towards=(0.6, 0.1, 0.0), name="look"),
    ]
    keep = ftqp.Keep(PANDA.tip, above=(0, 0, 0.47), name="table")
    return run(Planner(PANDA, tasks=tasks, constraints=[keep]), panda_circle())


def test_each_unit_of_soft_tasks_and_the_distances_have_a_panel(further_log, panda_log, drawn, tmp_path):
    assert runs.drawings_of(further_log)["tasks.png"] is errors.draw_further
    assert "tasks.png" not in runs.drawings_of(panda_log)
    errors.draw_further(further_log, tmp_path / "tasks.png")
    titles = [axes.get_title() for axes in drawn[0].axes]
    assert titles[0].startswith("Errors of soft tasks [mm]: largest") and titles[0].endswith("(elbow)")
    assert titles[1].startswith("Errors of soft tasks [deg]: largest") and titles[1].endswith("(look)")
    assert titles[2].startswith("Distances of points from their boundaries [mm]: smallest")
    assert legend(drawn[0]) == ["elbow", "look", "table"]
    for axes, group, factor in zip(drawn[0].axes, ("elbow", "look"), (1e3, 180.0 / np.pi), strict=False):
        assert axes.lines[0].get_ydata().max() == pytest.approx(
            factor * further_log[f"task_error.{group}"].max()
        )
    assert list(drawn[0].axes[2].lines[0].get_ydata()) == [0.0, 0.0]
    assert drawn[0].axes[2].get_ylim()[0] < 0.0


def test_every_axis_of_a_moving_base_has_its_panel_with_extremes_and_unit(drawn, tmp_path):
    robot = ftqp.robots.load("srs7")
    planner = Planner(robot, 0.01, level="velocity", emergency=None)
    task = ftqp.InertialTask(planner, ftqp.MovingBase())
    world = MovingWorld(task, Platform(), [Step("rotation", 0.3, at=0.2, rate=2.0)])
    log = run(
        planner, Hold(world.start() @ robot.pose(robot.neutral), duration=1.0), robot.neutral, world=world
    )
    assert "base.png" in runs.drawings_of(log)
    errors.draw_base(log, tmp_path / "base.png")
    axes = drawn[0].axes
    titles = [a.get_title() for a in axes]
    assert len(axes) == 8
    worst = 1e3 * log["inertial_error"][:, 1].min()
    assert f"Y error: {worst:+.3g} to" in titles[2] and titles[2].endswith("mm")
    assert titles[5].startswith("rotation error about Z") and titles[5].endswith("deg")
    assert titles[6:] == ["disturbance: base position", "disturbance: base rotation"]
    assert axes[6].texts[0].get_text() == "none"
    np.testing.assert_allclose(axes[7].lines[0].get_ydata(), np.rad2deg(log["disturbance.rotation"]))
    assert len({a.get_ylim() for a in axes[0:6:2]}) == 1
    assert legend(drawn[0]) == ["saturated"]


def test_five_pictures_of_runs_side_by_side_are_written(logs, tmp_path):
    files = compared_runs.save_comparison(logs, tmp_path / "new" / "figures", name="square", title="square")
    assert [file.name for file in files] == [f"square-{kind}.png" for kind in KINDS]
    assert sorted(file.name for file in files[0].parent.iterdir()) == sorted(file.name for file in files)


def test_errors_of_all_runs_share_one_logarithmic_panel(logs, drawn, tmp_path):
    compared_runs.draw_errors(logs, "the square", tmp_path / "a.png")
    (axes,) = drawn[0].axes
    assert axes.get_yscale() == "log" and axes.get_ylabel() == "position error [mm]"
    said = legend(drawn[0])
    assert said[2] == f"mtn, largest {events.length(logs['mtn']['position_error'].max())}"
    stop = logs["stops"]["t"][np.argmax(logs["stops"]["status"] >= 4)]
    assert said[3].endswith(f"stopped at {stop:.4g} s")
    np.testing.assert_allclose(axes.lines[2].get_ydata()[-50:], 1e3 * logs["mtn"]["position_error"][-50:])


def test_what_a_detector_finds_is_marked_and_who_was_told_not_said_where_runs_differ(logs, drawn, tmp_path):
    one = logs["one"]
    fault = dict(one.metadata["faults"][0])
    told = changed(one, faults=[fault | {"announced": fault["at"]}], detections=None)
    finds = changed(one, faults=[fault | {"announced": None}], detections=[{"detected_at": 1.25}])
    compared_runs.draw_errors({"told": told, "finds": finds}, "both", tmp_path / "errors.png")
    said = legend(drawn[0])
    assert "detector finds out at 1.25 s" in said
    assert not any("never reported" in text for text in said)
    lines = [line for line in drawn[0].axes[0].lines if set(np.asarray(line.get_xdata())) == {1.25}]
    assert len(lines) == 1


def test_the_legend_of_a_run_beside_rivals_tells_the_errors_that_are_drawn(drawn, tmp_path):
    schedule = Schedule([FaultEvent(0.25, Locked("panda_joint3"))])
    log = run(Planner(PANDA, dt=5e-3), panda_circle(0.5), schedule=schedule)
    error = np.zeros(len(log))
    error[10], error[70], error[-1] = 0.5, 0.0123, 0.0045  # the first is before the lock
    other = compared_runs.Rival(name="other", q=log["q"], tip=log["tip"][:, :3], error=error)
    compared_runs.draw_rivals(log, "own", [other], tmp_path / "rivals.png", "title")
    assert "other: at most 12.3 mm off, 4.5 mm at the end" in legend(drawn[0])
    assert any(label.startswith("own: at most ") for label in legend(drawn[0]))


POINTS = np.array([[0.0, 0.0, 0.3], [0.0, 0.0, 0.3], [0.3, 0.1, 0.6], [0.6, -0.1, 0.5]])
AXES = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
RANGES = np.array([[-1.0, 2.0], [-np.inf, np.inf], [0.0, 1.0]])
T = np.linspace(0.0, 2.0, 50)
GOAL = (1.5, 1.5)


@given(st.integers(1, 5000), st.integers(1, 700), st.integers(0, 99))
def test_thinned_curve_keeps_ends_and_every_extreme_of_a_bin(count, bins, seed):
    y = np.random.default_rng(seed).standard_normal(count)
    kept = canvas.thinned(y, bins=bins)
    assert (np.diff(kept) > 0).all() and kept[0] == 0 and kept[-1] == count - 1
    assert len(kept) <= 2 * bins + 2 + count // bins
    assert y[kept].max() == y.max() and y[kept].min() == y.min()


def test_gap_stays_a_gap():
    y = np.sin(np.arange(10_000.0))
    y[3000:6000] = np.nan
    kept = canvas.thinned(y, bins=100)
    inside = kept[(kept >= 3000) & (kept < 6000)]
    assert len(inside) > 10 and np.isnan(y[inside]).all()
    assert not np.isnan(y[kept[(kept < 3000) | (kept >= 6000)]]).any()


def arm_panels(drawn, folder, points=POINTS):
    q, limbs = np.array([0.5, 9.0, 0.2]), [[0, 1, 2, 3, 4]]
    up = np.array([0.0, 0.0, 1.0])
    arm_picture.draw_arm(folder / "a.png", "arm", ["a", "b", "c"], points, AXES, up, RANGES, q, limbs)
    return drawn[-1].axes


def test_joints_that_coincide_share_a_label_and_base_and_tip_are_named(drawn, tmp_path):
    for panel, title in zip(arm_panels(drawn, tmp_path), ("from the side", "from above"), strict=False):
        assert [text.get_text() for text in panel.texts] == ["1, 2", "3", "base", "tip"]
        assert panel.get_title() == title
    flat = arm_panels(drawn, tmp_path, POINTS * [1.0, 1.0, 0.0])
    assert flat[0].get_title() == "from above" and len(flat) == 2


def test_every_joint_has_its_range_and_an_endless_one_half_a_turn_either_way(drawn, tmp_path):
    panel = arm_panels(drawn, tmp_path)[-1]
    assert [label.get_text() for label in panel.get_yticklabels()] == ["1  a", "2  b", "3  c"]
    bars = [(bar.get_x(), bar.get_x() + bar.get_width()) for bar in panel.patches]
    assert bars[0] == (-1.0, 2.0)
    assert bars[1] == pytest.approx((9.0 - np.pi, 9.0 + np.pi))
    assert len(panel.lines) == 4 + 1  # two ends of each limited range, and the posture


def loop(drawn, folder, panels, **more):
    loop_picture.draw_loop(folder / "a.png", "title", panels, **more)
    return drawn[-1].axes


def test_curves_of_a_loop_and_the_fault_are_drawn_and_named(drawn, tmp_path):
    panels = {"error [mm]": {"a": (T, T), "b": (T, -T)}, "speed": {"v": (T, T**2)}}
    first, second = loop(drawn, tmp_path, panels, fault=(1.0, "joint 2 locks"))
    assert [text.get_text() for text in first.get_legend().get_texts()] == ["a", "b", "joint 2 locks"]
    assert np.array_equal(first.lines[1].get_ydata(), -T) and list(first.lines[2].get_xdata()) == [1.0, 1.0]
    assert (first.get_ylabel(), first.get_xlabel(), second.get_xlabel()) == ("error [mm]", "", "time [s]")
    assert first.lines[0].get_linewidth() > first.lines[1].get_linewidth()  # later ones do not hide it


@pytest.mark.parametrize(("name", "flat"), [("planar6", True), ("panda", False)])
def test_the_arm_of_a_loop_is_drawn_six_times_and_its_tip_is_where_it_was(drawn, tmp_path, name, flat):
    robot = ftqp.robots.load(name)
    motion = robot.neutral + 0.2 * T[:, None]
    arm, _ = loop(drawn, tmp_path, {"x": {"a": (T, T)}}, arm=(robot, motion))
    view = np.eye(3)[:2] if flat else loop_picture.OBLIQUE
    chains = [line.get_xydata() for line in arm.lines if len(line.get_xydata()) == robot.nv + 2]
    assert len(chains) == 6
    for chain, q in ((chains[0], motion[0]), (chains[-1], motion[-1])):
        assert np.allclose(chain[-1], view @ robot.pose(q)[:3, 3]) and np.allclose(chain[0], 0.0)


def test_edges_of_what_stands_around_an_arm_are_drawn_behind_it(drawn, tmp_path):
    edges = [((0.5, 0.0, 0.0), (0.5, 0.0, 1.0)), ((0.5, 0.0, 1.0), (0.5, 1.0, 1.0))]
    arm = ftqp.robots.load("panda")
    panels = {"error [mm]": {"a": (T, T)}}
    view = loop(drawn, tmp_path, panels, arm=(arm, np.tile(arm.neutral, (9, 1))), edges=edges)[0]
    assert np.allclose(view.lines[0].get_xydata(), np.array(edges[0]) @ loop_picture.OBLIQUE.T)
    assert np.allclose(view.lines[1].get_xydata(), np.array(edges[1]) @ loop_picture.OBLIQUE.T)
