"""A tally taken block by block says what one taken of the whole log says, whatever the blocks are."""

import json

import numpy as np
import pytest

from ftqp.control.paths import Circle
from ftqp.core.errors import FtqpError
from ftqp.faults.kinds import Degraded, Locked
from ftqp.sim.log.log_arrays import MemoryRows
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.metrics import EXACT, Following, Quantiles, TalliedRows, following_error, summary
from ftqp.sim.loop import Simulation
from ftqp.sim.schedule import FaultEvent, Schedule


@pytest.fixture
def run(fake, panda, start, tmp_path):
    """A run with two failures, a limit that is broken and one status that is not OK."""
    a = np.linspace(-1.0, 1.0, 7)
    a[3] = panda.limits.a_max[3] + 0.5
    simulation = Simulation(
        fake(panda, a=a, code=lambda k: 1 if k == 7 else 5 if k > 40 else 0),
        Circle(start, 0.05, duration=0.5),
        q=panda.neutral,
        schedule=Schedule([FaultEvent(0.1, Locked(2), 0.2), FaultEvent(0.1, Degraded(4, velocity=0.01))]),
        log=tmp_path / "log.npy",
    )
    return simulation.run(), load_log(tmp_path)


def test_a_run_sums_itself_up_as_its_log_does(run):
    result, log = run
    assert result.summary == summary(log)
    assert result.summary["stopped_at"] == pytest.approx(0.41)
    assert result.summary["max_limit_violation"]["a"] > 0.4
    json.dumps(result.summary, allow_nan=False)


@pytest.mark.parametrize("size", [1, 7, 50])
def test_blocks_of_any_size_give_the_same_figures(run, size):
    _, log = run
    (table,) = log.rows.blocks()
    kept = TalliedRows(MemoryRows(log.rows.columns, log.metadata), log.rows.columns, log.metadata)
    for first in range(0, len(table), size):
        kept.write(first, table[first : first + size])
    whole, pieces = summary(log), kept.facts()
    assert whole.pop("rms_position_error") == pytest.approx(pieces.pop("rms_position_error"), rel=1e-14)
    assert pieces == whole


def test_rows_that_are_written_twice_count_once(run):
    _, log = run
    (table,) = log.rows.blocks()
    kept = TalliedRows(MemoryRows(log.rows.columns, log.metadata), log.rows.columns, log.metadata)
    for first in (0, 0, 20, 20):
        kept.write(first, table[first : first + 20])
    assert kept.facts()["steps"] == 40


def test_rows_that_could_not_be_kept_do_not_count(run):
    _, log = run
    (table,) = log.rows.blocks()

    class Full(MemoryRows.__mro__[1]):
        full = True

        def write(self, first, rows):
            if self.full:
                raise FtqpError("the disk is full")

        def annotate(self, metadata):
            pass

        def close(self):
            pass

    full = Full()
    kept = TalliedRows(full, log.rows.columns, log.metadata)
    with pytest.raises(FtqpError):
        kept.write(0, table[:20])
    full.full = False
    kept.write(0, table[:30])
    assert kept.facts()["steps"] == 30


def test_following_error_goes_on_from_block_to_block():
    class Rows(dict):
        def __len__(self):
            return len(self["q"])

    q = np.arange(6.0)[:, None]
    rows = {"q": q, "q_command": q + 1.25, "truth": np.zeros((6, 1))}
    whole = following_error(Rows(rows))
    following = Following()
    parts = [following.add(Rows({key: value[k : k + 2] for key, value in rows.items()})) for k in (0, 2, 4)]
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    assert following.largest(0) == 0.25


def quantiles(values, pieces=3):
    found = Quantiles()
    for piece in np.array_split(values, pieces):
        found.add(piece)
    return found


def test_quantiles_of_few_numbers_are_those_of_numpy_and_what_is_no_number_is_left_out():
    values = np.random.default_rng(0).lognormal(size=5000)
    for percent in (0.0, 50.0, 99.0, 99.9, 100.0):
        assert quantiles([np.nan, *values, np.inf]).at(percent) == np.percentile(values, percent)
    assert Quantiles().at(50.0) is None


def test_quantiles_of_many_numbers_are_within_a_thousandth():
    values = np.random.default_rng(1).lognormal(mean=3.0, sigma=2.0, size=EXACT + 50_000)
    for percent in (1.0, 50.0, 99.0, 99.9):
        assert quantiles(values, 7).at(percent) == pytest.approx(np.percentile(values, percent), rel=1e-3)
    beyond = quantiles(np.concatenate([np.zeros(EXACT), np.full(EXACT, 1e30), [-1.0]]))
    assert beyond.at(10.0) < 1e-5 and beyond.at(90.0) > 1e7
