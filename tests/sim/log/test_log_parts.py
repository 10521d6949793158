"""A long log in parts: each is a log, all are one, and no interrupt loses what was written."""

import numpy as np
import pytest

from ftqp.core.errors import InputError
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.log_writer import LogParts, PartedLog, log_files
from ftqp.sim.log.signals import Column

COLUMNS = [Column("t", "s", "time"), Column("q.a", "rad", "position"), Column("q.b", "rad", "position")]


def rows(first, count):
    k = np.arange(first, first + count)
    return np.stack([k * 0.1, k, -k], axis=1)


def written(folder, count=100, keep=None, step=5):
    log = PartedLog(LogParts(path=folder / "log.npy", rows=20, keep=keep), COLUMNS, {"dt": 0.1})
    for first in range(0, count, step):
        log.write(first, rows(first, step))
    log.annotate({"state": "finished"})
    log.close()


def names(folder):
    return [file.name for file in log_files(folder)]


def test_parts_are_one_log_and_each_is_one(tmp_path):
    written(tmp_path)
    assert names(tmp_path) == [*(f"log-0000{k}.npy" for k in (1, 2, 3, 4)), "log.npy"]
    log = load_log(tmp_path)
    np.testing.assert_array_equal(log["q.a"], np.arange(100))
    assert log.metadata["state"] == "finished"
    part = load_log(tmp_path / "log-00002.npy")
    np.testing.assert_array_equal(part["q.a"], np.arange(20, 40))
    assert (part.metadata["state"], part.metadata["first_tick"], part.metadata["dt"]) == (
        "continued",
        20,
        0.1,
    )


def test_only_the_newest_parts_are_kept_where_that_is_asked_for(tmp_path):
    written(tmp_path, keep=2)
    assert names(tmp_path) == ["log-00004.npy", "log.npy"]
    np.testing.assert_array_equal(load_log(tmp_path)["q.a"], np.arange(60, 100))
    (tmp_path / "one").mkdir()
    written(tmp_path / "one", keep=1)
    assert names(tmp_path / "one") == ["log.npy"]


@pytest.mark.parametrize(
    ("begin", "end", "first", "last"),
    [
        (2.0, 3.0, 20, 30),
        (None, 0.95, 0, 9),
        (9.0, None, 90, 99),
        (3.05, 3.05, 31, 30),
        (50.0, 60.0, 100, 99),
    ],
)
def test_a_portion_is_what_lies_between_two_times(tmp_path, begin, end, first, last):
    written(tmp_path)
    log = load_log(tmp_path, begin=begin, end=end)
    np.testing.assert_array_equal(log["q.a"], np.arange(first, last + 1))


def test_signals_that_are_not_asked_for_are_not_loaded(tmp_path):
    written(tmp_path)
    assert load_log(tmp_path, signals=["t", "q"]).names == ("t", "q.a", "q.b")
    assert load_log(tmp_path, signals=["q.b"]).names == ("q.b",)
    with pytest.raises(InputError, match=r"'w' is not a signal of log .*; it has t, q"):
        load_log(tmp_path, signals=["w"])
    with pytest.raises(InputError, match="begin is -1"):
        load_log(tmp_path, begin=-1.0)


def test_a_missing_part_is_said(tmp_path):
    written(tmp_path)
    (tmp_path / "log-00003.npy").unlink()
    with pytest.raises(
        InputError, match=r"log-00004.npy does not go on where the part before it ends, at tick 40"
    ):
        load_log(tmp_path)
    assert len(load_log(tmp_path / "log-00004.npy")) == 20


def test_a_run_that_was_killed_between_two_parts_has_all_rows(tmp_path):
    written(tmp_path)
    (tmp_path / "log.npy").unlink()
    np.testing.assert_array_equal(load_log(tmp_path)["q.a"], np.arange(80))
