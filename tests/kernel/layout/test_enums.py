"""Codes and tables: what operators, logs and compiled code call them is one list each."""

import logging
import re

import numpy as np
import pytest

from ftqp.control.moving_base.inertial_task import BaseStatus
from ftqp.control.planner.status import StepStatus
from ftqp.kernel.compiled.library import level, load
from ftqp.kernel.entry.table import ENTRIES, PARTS, Spec
from ftqp.kernel.layout.enums import BaseCode, Claim, Status
from ftqp.kernel.layout.hypotheses import HYPOTHESES, SERVO_TIMES, TORQUE_TIMES, Hypothesis
from ftqp.qp.problem import SolveStatus
from ftqp.sim.log.signals import base_columns, columns

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
