"""Errors of soft tasks and distances of kept points: what a log has of them, and what a run says."""

import csv
import json

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError
from ftqp.sim.further_measures import FurtherMeasures
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.metrics import summary
from ftqp.sim.log.signals import PLANES, TASKS, names_in
from ftqp.sim.loop import MEMORY, Simulation
from ftqp.sim.schedule import FaultEvent, Schedule
from ftqp.sim.sensors.joint_sensors import JointSensors
from ftqp.sim.session.frame import DrawnArm

PANDA = ftqp.robots.load("panda")
TIP, ELBOW, DT = PANDA.tip, "panda_joint4", 1e-3


def own(state, J, b):
    J[0, 0], b[0] = 1.0, 0.0


def tasks():
    return [
        ftqp.PositionTask(ELBOW, rows="xz", target=(0.1, 9.0, 0.6), point=(0.0, 0.1, 0.0), name="elbow"),
        ftqp.AxisTask(TIP, towards=(0.6, 0.1, 0.0), name="look"),
        ftqp.AxisTask(ELBOW, along=(1.0, 0.0, 0.0), name="along"),
        ftqp.CentreOfMass("xy", name="mass"),
        ftqp.PostureTask(name="posture"),
        ftqp.JointTask({"panda_joint7": 0.8, 1: -0.3}, name="some joints"),
    ]


KEEPS = (
    ftqp.Keep(TIP, above=(0.0, 0.0, 0.45), name="tool"),
    ftqp.Keep(ELBOW, above=(0.0, 0.2, 0.0), normal=(0.0, -3.0, 0.0), point=(0.0, 0.0, 0.1), name="wall"),
    ftqp.Keep(TIP, inside=((0.1, -np.inf, 0.2), (0.9, 0.5, np.inf)), name="cell"),
    ftqp.Keep(ELBOW, axis=(0.0, 1.0, 0.0), along=(0.3, 0.0, 1.0), within=2.0, name="cup"),
    ftqp.Rows(1, lambda state, C, l, u: None, name="cable"),
)


def planner(**settings):
    return ftqp.Planner(PANDA, DT, **{"tasks": tasks(), "constraints": KEEPS, **settings})


def names(measures):
    return [one.name.partition(".")[2] for one in measures.columns]


def run(one, *, sensors=None, log=MEMORY, duration=0.3, schedule=None):
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.05, duration=duration)
    return Simulation(one, path, q=PANDA.neutral, sensors=sensors, log=log, schedule=schedule).run()


def test_what_is_measured_is_what_a_step_says():
    one = planner()
    q, target = PANDA.neutral.copy(), ftqp.Target(pose=PANDA.pose(PANDA.neutral))
    one.reset(q)
    measures = FurtherMeasures(one)
    for _ in range(50):
        step = one.step(q, None, target)
        numbers = dict(zip(names(measures), measures.at(q), strict=True))
        said = {name: task.error for name, task in step.tasks.items() if name in one.tasks}
        assert numbers["elbow"] == pytest.approx(np.linalg.norm(said["elbow"][[0, 2]]), abs=1e-12)
        assert numbers["mass"] == pytest.approx(np.linalg.norm(said["mass"][:2]), abs=1e-12)
        for name in ("look", "along"):
            assert np.sin(min(numbers[name], np.pi / 2)) == pytest.approx(np.linalg.norm(said[name]))
        for name in ("tool", "wall", "cell", "cup"):
            assert numbers[name] == pytest.approx(one.constraints[name].distance, abs=1e-12)
        assert numbers["posture"] == pytest.approx(np.linalg.norm(q - PANDA.neutral), abs=1e-15)
        assert numbers["some joints"] == pytest.approx(np.hypot(0.8 - q[6], -0.3 - q[1]))
        q = step.q.copy()
    one.tasks["elbow"].target = np.zeros(3)
    assert measures.at(q)[0] > 0.3


def test_poses_of_frames_are_measured_as_a_step_says_place_and_turn_apart():
    robot = ftqp.robots.load("dual_panda")
    goal = robot.pose(robot.neutral + 0.1, "right_hand")
    further = [
        ftqp.PoseTask("right_hand", target=goal, name="hand"),
        ftqp.RelativeTask("right_hand", "left_joint4", target=goal, name="in elbow"),
        ftqp.PoseTask("right_joint4", rows=("z", "rx"), target=goal, name="some rows"),
        ftqp.PoseTask("right_joint5", rows="orientation", target=goal, name="turn"),
        ftqp.AxisTask("left_joint5", towards="right_hand", name="look"),
    ]
    one = ftqp.Planner(robot, DT, tasks=further, emergency=None)
    q, target = robot.neutral.copy(), ftqp.Target(pose=robot.pose(robot.neutral))
    one.reset(q)
    measures = FurtherMeasures(one)
    assert dict(zip(names(measures), [one.unit for one in measures.columns], strict=True)) == {
        "hand": "m", "hand rotation": "rad", "in elbow": "m", "in elbow rotation": "rad",
        "some rows": "m", "some rows rotation": "rad", "turn": "rad", "look": "rad",
    }  # fmt: skip
    for _ in range(30):
        step = one.step(q, None, target)
        numbers = dict(zip(names(measures), measures.at(q), strict=True))
        said = {name: task.error for name, task in step.tasks.items() if name in one.tasks}
        for name in ("hand", "in elbow"):
            assert numbers[name] == pytest.approx(np.linalg.norm(said[name][:3]), abs=1e-12)
            assert numbers[f"{name} rotation"] == pytest.approx(np.linalg.norm(said[name][3:]), abs=1e-9)
        assert numbers["some rows"] == pytest.approx(abs(said["some rows"][2]), abs=1e-12)
        assert numbers["some rows rotation"] == pytest.approx(abs(said["some rows"][3]), abs=1e-9)
        assert numbers["turn"] == pytest.approx(np.linalg.norm(said["turn"][3:]), abs=1e-9)
        assert np.sin(min(numbers["look"], np.pi / 2)) == pytest.approx(np.linalg.norm(said["look"]))
        q = step.q.copy()
    places = measures.places(q)
    assert places["hand"] == pytest.approx(goal[:3, 3])
    assert places["in elbow"] == pytest.approx((robot.pose(q, "left_joint4") @ goal)[:3, 3])
    assert places["look"] == pytest.approx(robot.pose(q, "right_hand")[:3, 3])


def test_a_joint_without_end_is_off_by_the_short_way_round():
    robot = ftqp.robots.load("planar", count=3, continuous=True)
    one = ftqp.Planner(robot, DT, tasks=[ftqp.JointTask({0: 3.0}, name="turn")])
    (measured,) = FurtherMeasures(one).columns
    assert measured.unit == "rad"
    assert FurtherMeasures(one).at(np.array([-3.0, 0.5, 0.5]))[0] == pytest.approx(2.0 * np.pi - 6.0)


def test_a_load_moves_the_centre_of_mass_that_is_measured():
    one = planner()
    one.reset(PANDA.neutral)
    measures, at = FurtherMeasures(one), names(FurtherMeasures(one)).index("mass")
    before = measures.at(PANDA.neutral)[at]
    one.carry(ftqp.Payload(mass=3.0, com=(0, 0, 0.05)))
    assert before < 1e-12 < 1e-2 < measures.at(PANDA.neutral)[at]


def test_log_has_names_units_and_the_same_numbers_with_sensors_and_without():
    fast = run(planner()).log
    slow = run(planner(), sensors=JointSensors(PANDA, DT)).log
    for log in (fast, slow):
        errors, distances = (names_in(log, log.metadata, group) for group in (TASKS, PLANES))
        assert errors == ["elbow", "look", "along", "mass", "posture", "some joints"]
        assert distances == ["tool", "wall", "cell", "cup"]
        assert [log.units[f"task_error.{name}"] for name in errors] == ["m", "rad", "rad", "m", "rad", "rad"]
        assert [log.units[f"distance.{name}"] for name in distances] == ["m", "m", "m", "rad"]
    np.testing.assert_allclose(fast["task_error"], slow["task_error"], atol=1e-9)
    np.testing.assert_allclose(fast["distance"], slow["distance"], atol=1e-9)
    q = fast["q"][200]
    one = planner()
    one.reset(PANDA.neutral)
    row = np.concatenate([fast["task_error"][200], fast["distance"][200]])
    np.testing.assert_allclose(row, FurtherMeasures(one).at(q), atol=1e-12)


def test_the_angle_of_a_pose_is_told_beside_its_distance():
    goal = PANDA.pose(PANDA.neutral + 0.1, "panda_joint6")
    log = run(planner(tasks=[ftqp.PoseTask("panda_joint6", target=goal, name="wrist")])).log
    assert names_in(log, log.metadata, TASKS) == ["wrist", "wrist rotation"]
    told = summary(log)["tasks"]
    assert [told[name]["unit"] for name in ("wrist", "wrist rotation")] == ["m", "rad"]
    for name, facts in told.items():
        assert facts["max_error"] == log[f"task_error.{name}"].max() > 0.0
    shown = DrawnArm(PANDA).recorded(log, 5).further
    assert [one.name for one in shown[:2]] == ["wrist", "wrist rotation"]
    assert shown[1].value == log["task_error.wrist rotation"][5]


def test_a_task_of_ones_own_has_no_error_and_a_planner_without_tasks_no_columns():
    log = run(planner(tasks=[ftqp.LeastSquares(1, own, name="mine")], constraints=None)).log
    assert not [name for name in log.names if name.startswith((TASKS, PLANES))]
    assert log.metadata["tasks"] == [
        {"name": "mine", "kind": "least_squares", "level": 3, "weight": 1.0, "rows": 1}
    ]
    plain = run(ftqp.Planner(PANDA, DT)).log
    assert not {"tasks", "constraints"} & plain.metadata.keys()
    assert not {"tasks", "constraints"} & summary(plain).keys()
    with pytest.raises(InputError, match="task_error"):
        plain["task_error"]


def test_log_on_file_round_trips_and_exports_them(tmp_path):
    lock = Schedule([FaultEvent(0.1, ftqp.Locked(2))])
    done = run(planner(), log=tmp_path / "log.npy", schedule=lock)
    log, memory = load_log(tmp_path), run(planner(), schedule=lock).log
    np.testing.assert_array_equal(log["task_error"], memory["task_error"])
    np.testing.assert_array_equal(log["distance"], memory["distance"])
    assert log.metadata["tasks"] == memory.metadata["tasks"]
    assert log.metadata["constraints"] == memory.metadata["constraints"]
    tool, wall, cell, cup, cable = log.metadata["constraints"]
    assert (cell["kind"], cell["inside"]) == ("box", [[0.1, None, 0.2], [0.9, 0.5, None]])
    assert (cup["kind"], cup["within"]) == ("cone", 2.0) and cable == {
        "name": "cable",
        "kind": "rows",
        "rows": 1,
    }
    assert tool["frame"] == TIP and wall["joint"] == ELBOW and wall["normal"] == [0.0, -1.0, 0.0]
    np.testing.assert_allclose(tool["at_zero"], PANDA.pose(np.zeros(7))[:3, 3], atol=1e-12)
    facts = summary(log)
    for one in (said := dict(done.summary)), facts:  # rounding of sums depends on where arrays lie
        one["rms_position_error"] = round(one["rms_position_error"], 12)
    assert said == facts
    json.dumps(facts, allow_nan=False)
    assert facts["tasks"]["elbow"]["max_error"] == log["task_error.elbow"].max()
    assert facts["tasks"]["elbow"]["final_error"] == log["task_error.elbow"][-1]
    assert facts["constraints"]["tool"] == {
        "min_distance": log["distance.tool"].min(), "shape": "plane"
    }  # fmt: skip
    log.to_csv(tmp_path / "log.csv")
    log.to_npz(tmp_path / "log.npz")
    with (tmp_path / "log.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[100]["distance.wall"]) == log["distance.wall"][100]
    with np.load(tmp_path / "log.npz") as arrays:
        np.testing.assert_array_equal(arrays["task_error"], log["task_error"])
