"""A first use is announced before it begins, and compiles what is used and nothing else."""

import numpy as np
import pytest

import ftqp
from ftqp.control import first_use
from ftqp.core.errors import InputError
from ftqp.kernel.entry.table import ANY_SIZE, ENTRIES
from ftqp.kernel.layout.record import CAPACITIES


@pytest.fixture
def asked(monkeypatch):
    """What is asked of the compiler from here on: (names, capacity, whether it is announced)."""
    found = []

    def compile_entries(entries, capacity, announce=None):
        found.append(([entry.name for entry in entries], capacity, announce is not None))

    monkeypatch.setattr(first_use, "compile_entries", compile_entries)
    return found


def test_what_is_compiled_already_is_not_announced(capfd):
    first_use.warm_up(("kinematics",), CAPACITIES[0])
    capfd.readouterr()
    first_use.warm_up(("kinematics",), CAPACITIES[0])
    assert capfd.readouterr().err == ""


def test_entries_are_compiled_for_the_class_of_the_arm_and_announced(asked):
    first_use.warm_up(("step", "torques"), 16)
    assert asked == [(["step", "torques"], 16, True)]


def test_compilation_is_announced_on_stderr_before_it_begins(monkeypatch, capfd):
    said = []

    def compile_entries(entries, capacity, announce):
        with announce():
            said.append(capfd.readouterr().err)

    monkeypatch.setattr(first_use, "_told", False)
    monkeypatch.setattr(first_use, "compile_entries", compile_entries)
    first_use.warm_up(("step",), 8)
    first_use.warm_up(("torques",), 8)
    assert said == [first_use.NOTICE + "\n", ""]


def test_notice_names_the_remedy():
    assert "ftqp warmup" in first_use.NOTICE


@pytest.mark.parametrize(
    ("options", "entries"),
    [
        ({}, ["step"]),
        ({"scheme": "mvn_manipulability"}, ["step_rich"]),
        ({"task": ftqp.Task(damping=ftqp.DirectionalDamping())}, ["step_rich"]),
        ({"backend": "dtrnn"}, ["network_clock"]),
        ({"backend": "daqp"}, ["prepare_clock", "finish_clock"]),
        ({"scheme": "pseudoinverse"}, ["closed_form_clock"]),
    ],
    ids=str,
)
def test_planner_compiles_the_step_that_it_uses_and_no_other(panda, asked, options, entries):
    ftqp.Planner(panda, level="velocity", **options)
    found = {(name, capacity) for names, capacity, _ in asked for name in names}
    always = {("inverse_dynamics", 8), ("write_target", ANY_SIZE)}
    assert found - always == {(name, 8) for name in entries}


def test_step_compiles_torques_when_they_are_read_and_measures_need_nothing(panda, asked):
    planner = ftqp.Planner(panda, level="velocity")
    planner.reset(panda.neutral)
    step = planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=panda.pose(panda.neutral)))
    asked.clear()
    assert step.sigma_min > 0.0 and np.isfinite(step.tau).all()
    assert [names for names, _, _ in asked] == [["torques"]]


class TestAhead:
    """What ``ftqp warmup`` compiles."""

    @pytest.mark.parametrize(("joints", "capacity"), [(1, 8), (7, 8), (8, 8), (9, 16), (17, 32), (32, 32)])
    def test_common_planners_of_one_class_of_arms(self, joints, capacity):
        wanted = set(first_use.ahead(joints))
        of_arms = {(name, capacity) for name in first_use.COMMON}
        assert wanted == {("write_target", ANY_SIZE), *of_arms} and set(first_use.COMMON) <= set(ENTRIES)

    def test_everything_is_every_entry_once_a_class(self):
        wanted = first_use.ahead(None)
        assert len(wanted) == len(set(wanted))
        assert {name for name, _ in wanted} == set(ENTRIES)
        for name in ENTRIES:
            sizes = {size for other, size in wanted if other == name}
            assert sizes == ({ANY_SIZE} if name in first_use.ALONE else set(CAPACITIES))
        assert set(first_use.ALONE) == {
            *("solve_qp", "kkt", "solve_network", "solve_network_batch"),
            "write_target",
        }

    @pytest.mark.parametrize(
        ("joints", "sentence"),
        [
            (0, "joints is 0, expected a whole number from 1"),
            (33, "the arm has 33 joints, expected at most 32"),
        ],
    )
    def test_arm_that_there_is_not_is_refused(self, joints, sentence):
        with pytest.raises(InputError, match=sentence):
            first_use.ahead(joints)

    def test_one_is_compiled_without_a_word(self, asked):
        first_use.compile_one("step", 8)
        assert asked == [(["step"], 8, False)]
