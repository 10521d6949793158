"""Rows of a log as the kernel writes them, and what they tell of a run."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ftqp
from ftqp.control.paths import Circle
from ftqp.faults.kinds import Locked
from ftqp.model import catalog
from ftqp.qp import Recorder
from ftqp.sim.base.moving_world import Platform
from ftqp.sim.leader import ClockLeader, ClockTargets
from ftqp.sim.log.description import recorded
from ftqp.sim.log.log_arrays import Log, MemoryRows
from ftqp.sim.log.raw_rows import PER_JOINT, RawLayout, table
from ftqp.sim.log.signals import QP_CODES, base_columns, columns
from ftqp.sim.log.tick_recorder import TickRecorder
from ftqp.sim.schedule import FaultEvent, Schedule

COUNT = 40
EQUAL = ("position_error", "rotation_error", "scale", "status", "qp_status", "qp_iterations", "qp_residual",
         "sigma_min", "manipulability", "condition", "kappa", "progress", "path_status")  # fmt: skip


def drawn(layout, seed=0):
    generator = np.random.default_rng(seed)
    raw = generator.standard_normal((COUNT, layout.width))
    for name in ("target", "tip", "base_pose"):
        if name in layout.fields:
            turns = Rotation.random(COUNT, random_state=seed + len(name)).as_matrix()
            layout.poses(raw, name)[:, :, :3] = turns
    for name in ("belief", "truth", "status", "qp_status", "qp_iterations", "path_status", "base_status"):
        if name in layout.fields:
            raw[:, layout.fields[name]] = np.round(raw[:, layout.fields[name]])
    return raw


def test_columns_of_a_block_are_those_of_its_rows_by_other_means():
    panda, layout = catalog.load("panda"), RawLayout(7)
    raw = drawn(layout)
    log = Log.of_table(None, table(raw, layout), columns(panda.joints, np.zeros(7, bool), "velocity"), {})
    for raw_name, name in zip(PER_JOINT, ("q", "v", "a", "tau", "tau_brake", "lb", "ub", "belief", "truth"),
                              strict=True):  # fmt: skip
        np.testing.assert_array_equal(log[name], raw[:, layout.fields[raw_name]])
    for name in EQUAL:
        np.testing.assert_array_equal(log[name], raw[:, layout.fields[name]][:, 0])
    np.testing.assert_allclose(log["step_time"], 1e-3 * raw[:, layout.fields["step_time"]][:, 0])
    np.testing.assert_allclose(log["slack"], [np.linalg.norm(row) for row in raw[:, layout.fields["slack"]]])
    for k in range(COUNT):
        for name in ("target", "tip"):
            pose = layout.poses(raw, name)[k]
            np.testing.assert_array_equal(log[name][k, :3], pose[:, 3])
            turned = Rotation.from_matrix(pose[:, :3]).as_quat(canonical=True)
            np.testing.assert_allclose(log[name][k, 3:], turned, atol=1e-14)
        error = log["target"][k, :3] - log["tip"][k, :3]
        along = raw[k, layout.fields["velocity"]]
        expected = np.linalg.norm(np.cross(error, along)) / np.linalg.norm(along)
        assert abs(log["off_path"][k] - expected) < 1e-12


def test_columns_of_a_moving_base_follow():
    layout = RawLayout(7, 3)
    raw = drawn(layout)
    signals = (
        *columns(list("abcdefg"), np.zeros(7, bool), "velocity"),
        *base_columns(Platform().coordinates),
    )
    log = Log.of_table(None, table(raw, layout), signals, {})
    target, tip, base = (layout.poses(raw, name) for name in ("target", "tip", "base_pose"))
    turns = Rotation.from_matrix(target[:, :, :3]) * Rotation.from_matrix(tip[:, :, :3]).inv()
    np.testing.assert_allclose(log["inertial_error"][:, 3:], turns.as_rotvec(), atol=1e-12)
    np.testing.assert_array_equal(log["inertial_error"][:, :3], target[:, :, 3] - tip[:, :, 3])
    np.testing.assert_array_equal(log["base"][:, :3], base[:, :, 3])
    np.testing.assert_array_equal(log["disturbance"], raw[:, layout.fields["eta"]])
    np.testing.assert_array_equal(log["base_status"], raw[:, layout.fields["base_status"]][:, 0])


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
@pytest.mark.parametrize("damping", [None, ftqp.DirectionalDamping(threshold=1.0)])
def test_the_log_has_what_each_step_says(panda, start, level, damping):
    planner, said = ftqp.Planner(panda, 0.01, level=level, task=ftqp.Task(damping=damping)), []
    leader = ClockLeader(planner, ClockTargets(Circle(start, 0.1, duration=1.0), 0.01, mean=False))
    leader.reset(panda.neutral, np.zeros(7), 101)
    rows = MemoryRows(columns(panda.joints, panda.chain.prismatic, level), {})
    recorder = TickRecorder(rows, planner, leader)
    q, v = panda.neutral.copy(), np.zeros(7)
    for k in range(100):
        leader.aim(k, q)
        if k == 50:
            planner.report(Locked(2))
        step = leader.step(q, v)
        recorder.write(0.01 * k, q, v, step, 1000)
        said.append(step.copy())
        q, v = step.q.copy(), step.v.copy()
    recorder.flush()
    log = rows.log
    for name, part in (
        ("a", "a"),
        ("tau", "tau"),
        ("tau_brake", "tau_brake"),
        ("lb", "lower"),
        ("ub", "upper"),
    ):
        np.testing.assert_array_equal(log[name], [getattr(step, part) for step in said])
    for name in ("position_error", "rotation_error", "scale", "kappa"):
        np.testing.assert_array_equal(log[name], [getattr(step, name) for step in said])
    np.testing.assert_allclose(
        log["slack"], [np.linalg.norm(step.slack) for step in said], rtol=1e-12, atol=1e-15
    )
    np.testing.assert_allclose(log["sigma_min"], [step.sigma_min for step in said], rtol=1e-9)
    np.testing.assert_array_equal(log["status"], [step.code for step in said])
    np.testing.assert_array_equal(log["qp_status"], [QP_CODES[step.qp.status] for step in said])
    np.testing.assert_array_equal(log["qp_iterations"], [step.qp.iterations for step in said])
    np.testing.assert_array_equal(log["qp_residual"], [step.qp.residual for step in said])


@pytest.fixture(scope="module")
def recording():
    robot = ftqp.robots.load("planar6")
    recorder = Recorder("daqp", first=5, last=24)
    planner = ftqp.Planner(robot, 0.01, backend=recorder)
    recorder.follow(planner)
    path = ftqp.paths.Line(robot.pose(robot.neutral), (0.01, 0.0, 0.0), duration=0.5)
    schedule = Schedule([FaultEvent(0.2, ftqp.Locked(2, mode="instant"))])
    ftqp.Simulation(planner, path, q=robot.neutral, schedule=schedule).run()
    return recorded(recorder, planner, path, schedule, {"scenario": "a line"})


def test_ticks_are_those_of_the_run(recording):
    assert recording.tick.tolist() == list(range(5, 25))
    np.testing.assert_allclose(recording.time, 0.01 * recording.tick)


def test_metadata_tell_robot_fault_and_backend(recording):
    about = recording.metadata
    assert (about["robot"], about["backend"], about["scenario"]) == ("planar6", "daqp", "a line")
    assert about["faults"][0] | {"joint": "j3", "at": 0.2} == about["faults"][0]
    assert about["length"] > 0.0 and about["level"] == "acceleration" and "ftqp" in about["versions"]


def test_a_lock_shows_as_equal_bounds_and_a_cold_start(recording):
    fixed = recording.lb[:, 2] == recording.ub[:, 2]
    assert fixed.tolist() == [False] * 15 + [True] * 5
    assert np.flatnonzero(recording.cold).tolist() == [15]
