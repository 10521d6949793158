"""The record: its rooms mean the same to compiled code and to plain Python, are small, and have one owner."""

import copy
import pickle

import numpy as np
import pytest

from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import Session, rooms
from ftqp.kernel.jit import COMPILED, jit
from ftqp.kernel.layout.record import dtype

LAYOUTS = {
    "record": dtype("record", 8),
    "arm": dtype("arm", 8),
    "path": dtype("path", 8),
    "base": dtype("base", 8),
    "joints": dtype("joints", 8),
    "reduced problem": dtype("reduced", 8),
    "QP alone": dtype("standalone"),
}


def places(dtype, before=""):
    """Every field, with its rooms before it, and its type."""
    for name in dtype.names:
        kind = dtype[name]
        if kind.names is None:
            yield before + name, kind
        else:
            yield from places(kind, before + name + ".")


def readers(dtype):
    """Source of a function that reads the first and last number of every field, and of one that writes."""
    reads, writes = [], []
    for k, (place, kind) in enumerate(places(dtype)):
        ends = [""] if not kind.shape else [f"[{', '.join('0' * len(kind.shape))}]"]
        if kind.shape:
            ends.append(f"[{', '.join(str(size - 1) for size in kind.shape)}]")
        for j, end in enumerate(ends):
            reads.append(f"    out[{2 * k + j}] = K.{place}{end}")
            writes.append(f"    K.{place}{end} = out[{2 * k + j}]")
    return "def read(K, out):\n" + "\n".join(reads), "def write(K, out):\n" + "\n".join(writes)


def numbered(dtype):
    """Memory in which every field has numbers of its own."""
    memory = np.zeros(1, dtype)
    for k, (place, _) in enumerate(places(dtype)):
        view = memory
        for part in place.split("."):
            view = view[part]
        view[...] = 1000 * k + np.arange(view.size).reshape(view.shape)
    return memory


@pytest.mark.skipif(not COMPILED, reason="this run is without compilation")
@pytest.mark.parametrize(
    "name", [pytest.param("record", marks=pytest.mark.slow), "path", "base", "reduced problem"]
)
def test_every_field_is_the_same_place_to_compiled_code_and_to_plain_python(name):
    dtype = LAYOUTS[name]
    made = {}
    for source in readers(dtype):
        exec(source, made)
    count = 2 * sum(1 for _ in places(dtype))
    memory, plain, compiled = numbered(dtype), np.zeros(count), np.zeros(count)
    made["read"](rooms(memory), plain)
    jit(made["read"])(rooms(memory), compiled)
    assert np.array_equal(plain, compiled)
    assert len(set(plain[::2])) == count // 2  # each first number is a field's own

    by_python, by_compiled = np.zeros(1, dtype), np.zeros(1, dtype)
    made["write"](rooms(by_python), plain)
    jit(made["write"])(rooms(by_compiled), plain)
    assert by_python.tobytes() == by_compiled.tobytes() != bytes(dtype.itemsize)


@pytest.mark.parametrize("joints", [1, 7, 64])
def test_one_class_of_records_holds_every_arm(joints):
    assert Session(joints).K.state.q.shape == (64,)


def test_more_joints_than_any_class_holds_are_refused():
    with pytest.raises(InputError, match="65 joints, expected at most 64"):
        Session(65)


def starts(dtype, begin=0):
    """Every field's type and its first byte."""
    for name in dtype.names:
        kind, offset = dtype.fields[name][:2]
        yield kind, begin + offset
        yield from starts(kind, begin + offset) if kind.names else ()


def test_arrays_of_a_record_begin_lines_of_the_cache():
    found = list(starts(dtype("record", 32)))
    assert len(found) > 350
    assert all(offset % 64 == 0 for kind, offset in found if kind.itemsize >= 64)


@pytest.mark.parametrize(
    "copied",
    [lambda s: s.copy(), copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))],
    ids=["its own", "copy", "deepcopy", "pickle"],
)
def test_a_copied_session_holds_the_same_and_is_independent(copied):
    session = Session(7)
    session.K.chain.n, session.K.task.kp = 7, 3.0
    session.K.qp.lb[:] = -1.0
    other = copied(session)
    assert [one._memory.ctypes.data % 64 for one in (session, other)] == [0, 0]
    assert other.K.chain.n == 7 and other.K.task.kp == 3.0 and np.all(other.K.qp.lb == -1.0)
    field, number = other.field("qp", "lb"), other.field("task", "kp")
    other.K.task.kp, other.K.qp.lb[2] = 5.0, -9.0
    session.K.qp.ub[1] = 4.0
    assert session.K.task.kp == 3.0 and session.K.qp.lb[2] == -1.0 and other.K.qp.ub[1] == 0.0
    assert number[0] == 5.0 and field[2] == -9.0  # views of the copy's own record
    assert np.all(other.K.task.yielding == 1.0)
