"""The file of a recording comes back as it was, or an error says in a sentence what is wrong with it."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.going import closed_loop, targets_along

import ftqp
from ftqp.core.errors import InputError
from ftqp.qp import QPBuffers, Recorder, Recording
from ftqp.qp.recording.recorded_qps import SHAPES

SIZES = {"n": 3, "m": 1, "p": 2}


def fill(buffers: QPBuffers, k: int) -> None:
    """A strictly convex QP that changes with k."""
    n = buffers.n
    buffers.H[:] = np.eye(n) + 0.1 * np.ones((n, n))
    buffers.g[:] = np.sin(np.arange(n) + k)
    buffers.A[:] = 1.0
    buffers.b[:] = 0.01 * k
    buffers.C[:] = np.arange(buffers.C.size).reshape(buffers.C.shape)
    buffers.l[:], buffers.u[:] = [-1.0, -np.inf], [1.0, 2.0]
    buffers.lb[:], buffers.ub[:] = -0.3, 0.3


def record(recorder: Recorder, count: int = 5, first: int = 0) -> Recorder:
    """``count`` QPs through a recorder."""
    buffers = QPBuffers.zeros(**SIZES)
    recorder.setup(buffers)
    for k in range(first, first + count):
        fill(buffers, k)
        recorder.solve(cold=False)
    return recorder


def small(**metadata: Any) -> Recording:
    """Five QPs of three variables, an equality and two rows."""
    return record(Recorder("active_set")).recording(dt=0.1, metadata=metadata)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "qps.npz"
    small(robot="toy", faults=[{"joint": "j1"}]).save(path)
    return path


def test_a_saved_recording_comes_back_as_it_was(file):
    first, again = small(robot="toy", faults=[{"joint": "j1"}]), Recording.load(file)
    for name in SHAPES:
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))
    assert (again.variables, again.rows) == (first.variables, first.rows)
    assert again.metadata == {"robot": "toy", "faults": [{"joint": "j1"}], "backend": "active_set"}


def test_an_existing_file_is_left_alone(file):
    before = file.read_bytes()
    with pytest.raises(InputError, match="exists, and nothing is overwritten"):
        small().save(file)
    assert file.read_bytes() == before


def rewritten(file: Path, **changes) -> Path:
    """The file with arrays replaced, or taken out where the change is None."""
    with np.load(file) as archive:
        arrays = {name: archive[name] for name in archive.files} | changes
    path = file.with_name("changed.npz")
    np.savez_compressed(path, **{name: value for name, value in arrays.items() if value is not None})
    return path


def about(**changes) -> np.ndarray:
    content = {"format": 1, "variables": ["a", "b", "c"], "rows": ["d", "e", "f"], "metadata": {}}
    return np.array(json.dumps(content | changes))


DAMAGED = {
    "missing": ({"ub": None}, "is not a recording, or is damaged"),
    "shape": ({"H": np.eye(3)}, "is damaged .H has shape"),
    "version": ({"about": about(format=2)}, "has format 2, this ftqp reads 1; record it again"),
    "names": ({"about": about(rows=["d"])}, "rows has 1 different names, expected 3"),
}


@pytest.mark.parametrize(("changes", "message"), DAMAGED.values(), ids=DAMAGED)
def test_a_damaged_file_is_refused_in_one_sentence(file, changes, message):
    with pytest.raises(InputError, match=message) as caught:
        Recording.load(rewritten(file, **changes))
    assert "\n" not in str(caught.value)


def test_an_unknown_tick_is_answered_with_the_range_and_the_nearest():
    recording = small()
    sparse = replace(recording, tick=np.array([10, 12, 15, 20, 31]))
    with pytest.raises(InputError, match=r"tick 9 was not recorded, expected one of 0 to 4; .* is 4"):
        recording.position(9)
    with pytest.raises(InputError, match=r"one of 10 to 31 \(5 of them\); the nearest recorded one is 15"):
        sparse.position(16)
    with pytest.raises(InputError, match="nearest recorded one is 10"):
        sparse.position(-3)


def changed(name, change):
    value = np.array(getattr(small(), name))
    return {name: change(value)}


WRONG = {
    "too few rows": (changed("A", lambda a: a[:, :0]), r"A has shape \(5, 0, 3\), expected \(K, m, n\)"),
    "text": ({"b": np.array([["one"]] * 5)}, "b is no array of numbers"),
    "ticks": (changed("tick", lambda t: t[::-1]), "tick does not rise"),
    "few names": ({"variables": ("a", "b")}, "variables has 2 different names, expected 3"),
    "same names": ({"rows": ("a", "b", "b")}, "rows has 2 different names, expected 3"),
}


@pytest.mark.parametrize(("parts", "message"), WRONG.values(), ids=WRONG)
def test_parts_that_do_not_fit_are_refused(parts, message):
    with pytest.raises(InputError, match=message):
        replace(small(), **parts)


def test_a_qp_that_is_none_is_refused_when_it_is_asked_for():
    with pytest.raises(InputError, match="H is not symmetric"):
        replace(small(), **changed("H", lambda h: h + np.triu(np.ones((3, 3)), 1))).problem(0)


def test_answers_are_those_of_the_inner_backend():
    plain, buffers = ftqp.qp.backend("active_set"), QPBuffers.zeros(**SIZES)
    plain.setup(buffers)
    recorded = record(Recorder("active_set"), 6).recording(dt=0.1)
    for k in range(6):
        fill(buffers, k)
        assert plain.solve(cold=False) == recorded.claim[k]
        for name in ("x", "y", "z", "z_box"):
            np.testing.assert_array_equal(getattr(recorded, name)[k], getattr(buffers, name))


def test_recorded_problems_are_those_that_were_handed_over():
    buffers = QPBuffers.zeros(**SIZES)
    for k, problem in enumerate(record(Recorder("daqp"), 4).recording(dt=0.1)):
        fill(buffers, k)
        for name in ("H", "g", "A", "b", "C", "l", "u", "lb", "ub"):
            np.testing.assert_array_equal(getattr(problem, name), getattr(buffers, name))


@pytest.mark.parametrize("mode", ["slack", "scaled"])
@pytest.mark.parametrize("level", ["velocity", "acceleration"])
def test_planner_moves_the_same_with_a_recorder(level, mode):
    robot = ftqp.robots.load("panda")
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.05, duration=0.8)
    ends, lock = [], {75: lambda planner: planner.report(ftqp.Locked(2))}
    for backend in ("active_set", Recorder("active_set")):
        planner = ftqp.Planner(robot, 2e-3, level=level, task=ftqp.Task(mode=mode), backend=backend)
        *_, step = closed_loop(planner, targets_along(path, 150, 2e-3).at, 150, events=lock)
        ends.append(step.q.copy())
    np.testing.assert_allclose(ends[0], ends[1], rtol=0.0, atol=1e-9)


def test_ticks_and_names_are_those_of_the_planner():
    robot = ftqp.robots.load("planar6")
    recorder = Recorder("active_set", first=2, every=3)
    planner = ftqp.Planner(robot, 0.01, backend=recorder)
    recorder.follow(planner)
    planner.reset(robot.neutral)
    for _ in range(10):
        planner.step(robot.neutral, np.zeros(6), ftqp.Target(pose=robot.pose(robot.neutral)))
    recording = recorder.recording(dt=planner.dt)
    assert recording.tick.tolist() == [2, 5, 8]
    np.testing.assert_allclose(recording.time, [0.02, 0.05, 0.08])
    assert planner.backend == "recorder:active_set"
    assert recording.metadata["backend"] == "active_set"


def test_nothing_recorded_is_an_error_that_says_what_to_do():
    with pytest.raises(InputError, match="no QP was recorded; let the planner step"):
        Recorder("active_set").recording(dt=0.1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"every": 0}, "every is 0, expected a whole number from 1"),
        ({"inner": "daqpp"}, "did you mean 'daqp'"),
        ({"inner": Recorder("daqp")}, "recorder:daqp records already"),
    ],
)
def test_wrong_arguments_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        Recorder(**{"inner": "daqp", **arguments})
