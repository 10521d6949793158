"""The record: its rooms mean the same to compiled code and to plain Python, are small, and have one owner."""

import copy
import pickle
from itertools import permutations

import numpy as np
import pytest
from session_ticks import Ticks

import ftqp
from ftqp.core.errors import InputError
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.entry.session import Session, rooms
from ftqp.kernel.jit import COMPILED, jit
from ftqp.kernel.layout.record import KINDS, dtype
from ftqp.kernel.layout.rows import (
    HOLD,
    HOLDING,
    KEEP,
    ROW_KINDS,
    TORQUE,
    constraint_capacity,
    constraint_labels,
    constraint_owners,
    kind_of,
)
from ftqp.kernel.layout.structures import sections
from ftqp.kernel.rows.constraint_rows import add_constraints
from ftqp.kernel.rows.failed_joints import sort_joints

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


def test_no_record_begins_with_all_fields_of_another_one() -> None:
    """numba takes a record that begins as another one for a kind of that."""
    fields = {kind: list(dtype(kind).fields.items()) for kind in KINDS}
    for shorter, longer in permutations(fields, 2):
        same = fields[longer][: len(fields[shorter])] == fields[shorter]
        assert not same, f"{longer} begins as {shorter} does"


def names_of(dtype):
    """Every field of a record and of its rooms."""
    for name, (field, *_) in (dtype.fields or {}).items():
        yield name
        yield from names_of(field.base)


@pytest.mark.parametrize("kind", KINDS)
def test_no_field_has_a_name_that_records_of_numpy_have_for_themselves(kind):
    """In plain Python ``F.T`` would be the transpose of F, and not its field."""
    assert not [field for field in names_of(dtype(kind, 8)) if hasattr(np.record, field)]


def test_a_line_gives_its_fields_with_their_shape_and_one_that_is_none_is_refused():
    made = sections("room  Of a test.\n    a b  f8[2*N]  what they\n        mean\n    c  i8\n", {})
    assert made["room"](4) == [("a", "f8", (8,)), ("b", "f8", (8,)), ("c", "i8")]
    with pytest.raises(ValueError, match="is no line of fields"):
        sections("room\n    a  f9\n", {})


PANDA = ftqp.robots.load("panda")
Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
V = np.array([0.3, -0.2, 0.1, 0.25, -0.4, 0.2, 0.35])
DT = 0.002


def constrained(level, codes=(), robot=PANDA):
    """The record of a moving arm with all its rows of C; what is beyond them was NaN before."""
    K = Ticks(robot, DT, level=level, torque_limits=robot.has_inertia).K
    K.state.q[:7], K.state.v[:7] = Q, V
    for joint, code in codes:
        K.faults.code[joint] = code
        K.faults.friction[joint] = 0.5
    sort_joints(K.faults, K.chain)
    forward_kinematics(K, K.state)
    if level == "acceleration":
        motion(K, K.state)
    for field in (K.qp.C, K.qp.l, K.qp.u):
        field[...] = np.nan
    add_constraints(K)
    return K


def test_counts_labels_and_owners_agree_with_the_rows_that_are_filled(level):
    K = constrained(level)
    filled = int(K.qp.nc)
    labels = constraint_labels(PANDA.joints, True)
    assert filled == len(labels) == int(K.cascade.p)
    assert np.isfinite(K.qp.C[:filled, :7]).all()
    assert not np.isnan(K.qp.l[:filled]).any() and not np.isnan(K.qp.u[:filled]).any()
    assert np.isnan(K.qp.C[filled:]).all() and np.isnan(K.qp.l[filled:]).all()
    owners = constraint_owners(PANDA.joints, True)
    assert [kind for kind, _, _ in owners[filled:]] == [HOLDING] * 7, "behind those of every tick"
    for label, (kind, joint, _) in zip(labels, owners, strict=False):
        assert label == kind.label(PANDA.joints[joint]) and label.startswith(kind.prefix)
        assert label.removeprefix(kind.prefix) == PANDA.joints[joint]


@pytest.mark.parametrize(("level", "scale"), [("acceleration", 1.0), ("velocity", DT)])
def test_a_torque_row_limits_the_joint_that_owns_it(level, scale):
    K = constrained(level)
    M, h = K.kinematics.M[:7, :7], K.kinematics.h[:7]
    before = M @ V if level == "velocity" else np.zeros(7)
    owners = constraint_owners(PANDA.joints, True)
    assert [row for row, (kind, _, _) in enumerate(owners) if kind is TORQUE] == [*range(7)]
    for row, (_, joint, _) in enumerate(owners[:7]):
        assert np.array_equal(K.qp.C[row, :7], M[joint])
        tau_max = PANDA.limits.tau_max[joint]
        ends = scale * (np.array([-tau_max, tau_max]) - h[joint]) + before[joint]
        assert [K.qp.l[row], K.qp.u[row]] == pytest.approx(ends, rel=1e-12)


def test_an_arm_without_masses_has_no_rows_that_need_them():
    assert constraint_owners(PANDA.joints, False) == ()
    assert constraint_labels(PANDA.joints, False, {"keep": ["a", "b"]}) == ("keep a", "keep b")
    K = constrained("velocity", robot=ftqp.robots.load("srs7"))
    assert K.qp.nc == 0 and np.isnan(K.qp.l).all()


def test_rows_that_a_planner_asks_for_stand_behind_those_of_joints():
    asked = {"hold": ["grip x", "grip rz"], "keep": ["table", "wall"]}
    owners = constraint_owners(PANDA.joints, True, asked)
    assert owners[6:9] == ((TORQUE, 6, "panda_joint7"), (KEEP, 0, "table"), (KEEP, 1, "wall"))
    assert owners[9:11] == ((HOLD, 0, "grip x"), (HOLD, 1, "grip rz"))
    labels = constraint_labels(PANDA.joints, True, asked)
    assert labels[7:] == ("keep table", "keep wall", "hold grip x", "hold grip rz")
    assert [kind_of(label) for label in labels[6:10]] == [TORQUE, KEEP, KEEP, HOLD]


@pytest.mark.parametrize("capacity", [8, 16, 32])
def test_a_record_has_room_for_every_row_of_its_class(capacity):
    qp = dtype("record", capacity)["qp"]
    assert qp["C"].shape == (constraint_capacity(capacity), capacity + 1)
    assert qp["l"].shape == qp["u"].shape == qp["z"].shape == (constraint_capacity(capacity),)
    joints = [str(i) for i in range(capacity)]
    asked = {kind.name: [f"{kind.name} {i}" for i in range(kind.most)] for kind in ROW_KINDS if kind.most}
    owners = constraint_owners(joints, True, asked)
    assert len({(kind.name, i) for kind, i, _ in owners}) == len(owners) == constraint_capacity(capacity)
