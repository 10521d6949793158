"""A long log in parts: each is a log, all are one, and no interrupt loses what was written."""

import resource

import numpy as np
import pytest

from ftqp.core.errors import FtqpError, InputError
from ftqp.sim.log import log_writer
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.log_writer import LogParts, LogWriter, PartedLog, log_files
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


PLACES = {
    "annotate": (LogWriter, "annotate"),
    "close": (LogWriter, "close"),
    "rename": (log_writer.Path, "rename"),
    "unlink": (log_writer.Path, "unlink"),
    "made": (PartedLog, "_made"),
    "made-late": (PartedLog, "_made"),
}


@pytest.mark.parametrize("where", PLACES)
def test_turning_to_a_new_part_can_be_interrupted_anywhere(tmp_path, monkeypatch, where):
    log = PartedLog(LogParts(path=tmp_path / "log.npy", rows=20, keep=2), COLUMNS, {})
    for first in (0, 20, 40):
        log.write(first, rows(first, 20))
    place, name = PLACES[where]
    body = getattr(place, name)

    def interrupted(*args, **keywords):
        if where == "made-late":
            body(*args, **keywords).close()
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(place, name, interrupted)
        with pytest.raises(KeyboardInterrupt):
            log.write(60, rows(60, 20))
    log.write(60, rows(60, 20))
    log.annotate({"state": "interrupted"})
    log.close()
    assert names(tmp_path) == ["log-00003.npy", "log.npy"]
    found = load_log(tmp_path)
    np.testing.assert_array_equal(found["q.a"], np.arange(40, 80))
    assert found.metadata["state"] == "interrupted"


def test_a_disk_that_is_full_in_the_middle_keeps_all_parts_before(tmp_path):
    log = PartedLog(LogParts(path=tmp_path / "log.npy", rows=20), COLUMNS, {})
    for first in (0, 20, 40):
        log.write(first, rows(first, 20))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10, hard))
    try:
        with pytest.raises(FtqpError, match="cannot be"):
            log.write(60, rows(60, 20))
        with pytest.raises(FtqpError, match="cannot be"):
            log.write(60, rows(60, 20))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    log.close()
    np.testing.assert_array_equal(load_log(tmp_path)["q.a"], np.arange(60))
