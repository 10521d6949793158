"""The table of entry points says what each takes and calls, and every one is built."""

import logging

import pytest

from ftqp.kernel.compiled.kernel import level, load
from ftqp.kernel.entry.spec import Spec
from ftqp.kernel.entry.table import ENTRIES, PARTS


@pytest.mark.skipif(not level(), reason="no built kernel is in use")
def test_every_entry_point_is_built(caplog):
    """Built means: its code allocates nothing and needs nothing of numba, else it is refused."""
    built = PARTS["all"]
    assert {entry.name for entry in built} | {"deployed_step", "deployed_follow"} == set(ENTRIES)
    with caplog.at_level(logging.WARNING, "ftqp"):
        assert all(isinstance(load(one), type(len)) for one in built)
    assert not caplog.records


def test_a_kind_of_argument_that_is_none_is_refused():
    with pytest.raises(ValueError, match="'K:recrod' in 'n K:recrod' is no argument"):
        _ = Spec("ftqp.kernel.told.stops", "n K:recrod", "stop(K)").signature
