"""Records and their codes: how they are laid out, copied and named."""

import copy
import logging
import pickle
import re
from itertools import permutations

import numpy as np
import pytest

import ftqp
from ftqp.control.moving_base.inertial_task import BaseStatus
from ftqp.control.planner.status import StepStatus
from ftqp.core.errors import InputError
from ftqp.kernel.compiled.library import level, load
from ftqp.kernel.entry.session import Session
from ftqp.kernel.entry.table import ENTRIES, PARTS, Spec
from ftqp.kernel.layout.enums import BaseCode, Claim, Status
from ftqp.kernel.layout.hypotheses import HYPOTHESES, SERVO_TIMES, TORQUE_TIMES, Hypothesis
from ftqp.kernel.layout.record import KINDS, dtype, used_words
from ftqp.kernel.layout.rows import (
    HOLD,
    KEEP,
    ROW_KINDS,
    TORQUE,
    constraint_capacity,
    constraint_labels,
    constraint_owners,
    kind_of,
)
from ftqp.kernel.layout.structures import sections
from ftqp.qp.problem import SolveStatus
from ftqp.sim.log.signals import base_columns, columns


def test_more_joints_than_any_class_holds_are_refused():
    with pytest.raises(InputError, match="65 joints, expected at most 64"):
        Session(65)


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


def test_used_words_are_the_begins_that_a_record_for_fewer_joints_has_room_for():
    whole, small = np.zeros(1, dtype("record")), dtype("record", 8)
    words = whole.view(np.int64)
    for begin, end in used_words(7):
        words[begin:end] = 1
    for room in small.names:
        for name in small[room].names:
            field, shape = np.atleast_1d(whole[room][name][0]).view(np.int64), small[room][name].shape or (1,)
            inside = np.zeros(np.shape(field), dtype=np.int64)
            inside[tuple(slice(length) for length in shape)] = 1
            assert np.array_equal(field, inside), f"{room}.{name}"
    runs = used_words(64)
    assert (runs[1:, 0] > runs[:-1, 1]).all() and runs[-1, 1] <= len(words)


SPOKEN = {StepStatus: Status, BaseStatus: BaseCode, SolveStatus: Claim}
"""What people read, and what compiled code compares."""


@pytest.mark.parametrize("spoken", SPOKEN, ids=lambda spoken: spoken.__name__)
def test_every_code_has_one_sentence_in_the_same_place(spoken):
    kernel = SPOKEN[spoken]
    assert [member.name for member in spoken] == [member.name for member in kernel]
    assert [int(member) for member in kernel] == list(range(len(kernel)))
    sentences = [member.value for member in spoken]
    assert len(set(sentences)) == len(sentences) and all(" " in sentence for sentence in sentences)


def told(column):
    """What the log says of one of its columns."""
    table = (*columns(("j",), np.zeros(1, dtype=bool), "acceleration"), *base_columns(("x",)))
    return next(one.description for one in table if one.name == column)


@pytest.mark.parametrize(("column", "kernel"), [("status", Status), ("base_status", BaseCode)])
def test_a_log_s_column_of_codes_names_exactly_the_members(column, kernel):
    listed = re.findall(r"(\d+) ([A-Z][A-Z_]+)", told(column))
    assert [(int(code), name) for code, name in listed] == [(int(member), member.name) for member in kernel]


def test_a_log_s_column_of_claims_lists_every_one():
    codes = [int(code) for code in re.findall(r"(?<!-)\b(\d+) \w+", told("qp_status"))]
    assert codes == list(range(len(Claim)))


def test_times_are_those_of_the_rows_and_above_zero():
    counted = list(Hypothesis)[:HYPOTHESES]
    assert tuple(row.torque for row in counted) == TORQUE_TIMES
    assert tuple(row.servo for row in counted) == SERVO_TIMES
    assert min(*TORQUE_TIMES, *SERVO_TIMES) > 0.0


@pytest.mark.skipif(not level(), reason="no built kernel is in use")
def test_every_entry_point_is_built(caplog):
    """Built means: its code allocates nothing and needs nothing of numba, else it is refused."""
    built = PARTS["all"]
    from_c = {"deployed_step", "deployed_follow", "deployed_go", "deployed_seek"}
    assert {entry.name for entry in built} | from_c == set(ENTRIES)
    with caplog.at_level(logging.WARNING, "ftqp"):
        assert all(isinstance(load(one), type(len)) for one in built)
    assert not caplog.records


def test_a_kind_of_argument_that_is_none_is_refused():
    with pytest.raises(ValueError, match="'K:recrod' in 'n K:recrod' is no argument"):
        _ = Spec("ftqp.kernel.commands.stops", "n K:recrod", "stop(K)").signature
