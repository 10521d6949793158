"""The table of entry points says how each is called, and every one is built."""

import inspect
import logging

import pytest
from records import SMALL

from ftqp.kernel.compiled.kernel import level, load
from ftqp.kernel.entry.table import ANY_SIZE, BUILT, ENTRIES

ANY = {"solve_qp", "kkt", "solve_network", "solve_network_batch", "write_target"}
"""Those that know no robot."""
OBJECTS = {
    "q",
    "v",
    "target",
    "targets",
    "tick",
    "pose",
    "twist",
    "acceleration",
    "limit",
    "tau",
    "q_ref",
    "v_ref",
    "a_ref",
    "effort",
}
"""What compiled code takes as Python objects: what a caller hands to a step, and the step itself."""


def capacity_of(name):
    """The class of records that a test makes it for."""
    return ANY_SIZE if name in ANY else SMALL


@pytest.mark.parametrize("name", ENTRIES)
def test_an_entry_point_takes_as_many_arguments_as_the_table_says_and_objects_in_their_places(name):
    entry = ENTRIES[name]
    function = entry.function(capacity_of(name))
    parameters = list(inspect.signature(function).parameters)
    assert function.__name__ == entry.name == name == entry.factory
    assert len(parameters) == len(entry.signature)
    objects = {p for p, letter in zip(parameters, entry.signature, strict=True) if letter == "o"}
    assert objects == OBJECTS & set(parameters)


@pytest.mark.skipif(not level(), reason="no built kernel is in use")
def test_every_entry_point_is_built(caplog):
    """Built means: its code allocates nothing and needs nothing of numba, else it is refused."""
    assert {entry.name for entry, _ in BUILT} == set(ENTRIES)
    with caplog.at_level(logging.WARNING, "ftqp"):
        assert all(isinstance(load(*one), type(len)) for one in BUILT)
    assert not caplog.records
