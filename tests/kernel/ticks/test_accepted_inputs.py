"""What a caller hands to a step is copied: right or a clean error, whatever becomes of it, and forgotten."""

import array
import gc

import numpy as np
import pytest

import ftqp

ROBOT = ftqp.robots.load("panda")
Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
V = np.array([0.3, -0.2, 0.1, 0.25, -0.4, 0.2, 0.35])
DT = 0.002


def planner_at_start():
    """A Panda's planner, reset."""
    planner = ftqp.Planner(ROBOT, DT, emergency=None, torque_limits=False)
    planner.reset(Q, V)
    return planner


@pytest.fixture
def planner():
    """A planner of the test's own."""
    return planner_at_start()


@pytest.fixture
def fed_copies():
    """Another planner, which only ever sees fresh float64 copies."""
    return planner_at_start()


@pytest.fixture
def aim():
    """A target near the start, moving."""
    pose = ROBOT.pose(Q)
    pose[:3, 3] += [0.002, -0.001, 0.001]
    return ftqp.Target(pose=pose, twist=[0.02, 0.01, 0.0, 0.0, 0.05, 0.0])


def same(one, other):
    """Whether two steps command the same, to the bit."""
    return one.code == other.code and all(
        np.array_equal(getattr(one, name), getattr(other, name)) for name in ("q", "v", "a", "task_error")
    )


def check(planner, fed_copies, q, v, aim):
    """One step of each; the second planner gets copies."""
    copies = np.array(q, dtype=np.float64), np.array(v, dtype=np.float64)
    step, expected = planner.step(q, v, aim), fed_copies.step(*copies, ftqp.Target(pose=aim.pose.copy(),
                                  twist=aim.twist.copy(), acceleration=aim.acceleration.copy()))  # fmt: skip
    assert same(step, expected)
    return step.q.copy(), step.v.copy()


def strided(a):
    """Every third number of a larger array."""
    wide = np.full(3 * len(a), np.nan)
    wide[::3] = a
    return wide[::3]


def backwards(a):
    """A view with a negative stride."""
    return a[::-1].copy()[::-1]


def unaligned(a):
    """Float64 numbers that begin at an odd address."""
    raw = np.zeros(8 * len(a) + 1, np.uint8)
    raw[1:] = np.frombuffer(np.ascontiguousarray(a).tobytes(), np.uint8)
    return raw[1:].view(np.float64)


def read_only(a):
    """An array that cannot be written."""
    a = a.copy()
    a.setflags(write=False)
    return a


FORMS = {
    "list": list,
    "tuple": tuple,
    "big-endian": lambda a: a.astype(">f8"),
    "long double": lambda a: a.astype(np.longdouble),
    "strided": strided,
    "backwards": backwards,
    "column": lambda a: np.stack([a, a], axis=1)[:, 0],
    "unaligned": unaligned,
    "read-only": read_only,
    "objects": lambda a: a.astype(object),
    "array.array": lambda a: array.array("d", a),
    "memoryview": lambda a: memoryview(a.copy()),
    "subclass": lambda a: a.copy().view(np.recarray),
    "masked": lambda a: np.ma.array(a.copy()),
    "fresh": np.copy,
}


@pytest.mark.parametrize("form", FORMS)
def test_numbers_in_any_form_give_the_command_of_float64_arrays(planner, fed_copies, aim, form):
    make, q, v = FORMS[form], Q.copy(), V.copy()
    for _ in range(4):
        q, v = check(planner, fed_copies, make(q), make(v), aim)


def test_an_array_is_read_as_it_is_at_the_step(planner, fed_copies, aim):
    q, v = Q.copy(), V.copy()
    for k in range(6):
        check(planner, fed_copies, q, v, aim)
        q += 1e-3 * (k + 1)
        v *= 0.9
        aim.position[0] += 1e-4


def test_no_buffer_is_held_after_a_step(planner, aim):
    q, v = bytearray(Q.tobytes()), bytearray(V.tobytes())
    planner.step(memoryview(q).cast("d"), memoryview(v).cast("d"), aim)
    planner.step(Q, V, aim)
    gc.collect()
    q.clear()  # raises BufferError while anybody holds it
    v.clear()


@pytest.mark.parametrize("row", [-1, 5, 10**6, -(10**6), 2**58, 2**59, -(2**62)])
def test_a_row_that_a_trajectory_does_not_have_is_a_clean_error(planner, fed_copies, aim, row):
    targets = ftqp.Targets(pose=np.stack([aim.pose] * 5))
    targets.row = row
    with pytest.raises(ftqp.InputError, match=r"make a new Target|take targets\.at"):
        planner.step(Q, V, targets)
    check(planner, fed_copies, Q, V, aim)
