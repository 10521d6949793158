import json
import resource

import numpy as np
import pytest

from ftqp.core.errors import FtqpError, InputError
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.log_writer import LogWriter
from ftqp.sim.log.raw_rows import BLOCK
from ftqp.sim.log.signals import Column, columns

COLUMNS = [
    Column("t", "s", "time"),
    Column("q.a", "rad", "position"),
    Column("q.b", "rad", "position"),
    Column("status", "-", "code", True),
]


def rows(first, count):
    k = np.arange(first, first + count)
    return np.stack([k * 0.1, k, -k, k % 3], axis=1)


def write(path, count, metadata=None, columns=COLUMNS):
    with LogWriter(path, columns, metadata or {}) as log:
        for first in range(0, count, BLOCK):
            log.write(first, rows(first, min(BLOCK, count - first)))


@pytest.mark.parametrize("count", [0, 1, BLOCK, 2 * BLOCK + 7])
def test_log_gives_back_what_was_written(tmp_path, count):
    write(tmp_path / "log.npy", count, {"scenario": {"robot": {"name": "panda"}}, "dt": 0.1})
    log = load_log(tmp_path / "log.npy")
    k = np.arange(count)
    assert len(log) == count
    assert log.names == ("t", "q.a", "q.b", "status")
    np.testing.assert_array_equal(log["t"], k * 0.1)
    np.testing.assert_array_equal(log["q"], np.stack([k, -k], axis=1))
    np.testing.assert_array_equal(log["status"], k % 3)
    assert log["status"].dtype == np.int64
    assert log.units["q.a"] == "rad"
    assert log.descriptions["t"] == "time"
    assert log.metadata["scenario"] == {"robot": {"name": "panda"}}
    assert log.metadata["dt"] == 0.1


def test_any_python_reads_the_rows_as_the_file_itself_says(tmp_path):
    write(tmp_path / "log.npy", BLOCK + 4)
    about = json.loads((tmp_path / "log.json").read_text())
    assert [column["name"] for column in about["columns"]] == ["t", "q.a", "q.b", "status"]
    np.testing.assert_array_equal(np.load(tmp_path / "log.npy"), rows(0, BLOCK + 4))


def test_existing_file_is_never_overwritten(tmp_path):
    write(tmp_path / "l.npy", 1)
    with pytest.raises(InputError, match="exists already; choose another folder"):
        LogWriter(tmp_path / "l.npy", COLUMNS, {})
    assert {file.name for file in tmp_path.iterdir()} == {"l.npy", "l.json"} and len(
        load_log(tmp_path / "l.npy")
    ) == 1
    (tmp_path / "link.npy").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="exists already; choose another folder"):
        LogWriter(tmp_path / "link.npy", COLUMNS, {})


def test_full_disk_is_an_error(tmp_path):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    with LogWriter(tmp_path / "l.npy", COLUMNS, {"state": "running"}) as log:
        log.write(0, rows(0, BLOCK))
        resource.setrlimit(resource.RLIMIT_FSIZE, ((tmp_path / "l.npy").stat().st_size, hard))
        try:
            with pytest.raises(FtqpError, match="cannot be written"):
                log.write(BLOCK, rows(BLOCK, BLOCK))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    log = load_log(tmp_path / "l.npy")
    assert (len(log), log.metadata["state"]) == (BLOCK, "running")


@pytest.mark.parametrize("content", [b"hello, I am text", b"\x00" * 4096, b"", b"SQLite format 3\x00" * 300])
def test_file_that_is_not_a_log_is_refused(tmp_path, content):
    (tmp_path / "x.npy").write_bytes(content)
    with pytest.raises(InputError, match="is not a log of ftqp"):
        load_log(tmp_path / "x.npy")


def test_missing_log_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"log .*x.npy does not exist"):
        load_log(tmp_path / "x.npy")
    with pytest.raises(InputError, match=r"log .*log.npy does not exist"):
        load_log(tmp_path)


def test_unknown_signal_names_the_known_ones(tmp_path):
    write(tmp_path / "l.npy", 1)
    with pytest.raises(
        InputError, match=r"'statos' is not a signal of log .* \(did you mean 'status'\?\); it has t, q, "
    ):
        load_log(tmp_path / "l.npy")["statos"]


def test_columns_have_units_of_their_joints():
    units = {c.name: c.unit for c in columns(["turn", "slide"], np.array([False, True]), "velocity")}
    assert (units["q.turn"], units["q.slide"]) == ("rad", "m")
    assert (units["a.turn"], units["a.slide"]) == ("rad/s2", "m/s2")
    assert (units["tau.turn"], units["tau.slide"]) == ("N m", "N")
    assert units["lb.slide"] == "m/s"


def test_log_of_before_is_refused_in_a_sentence_that_says_what_reads_it(tmp_path):
    (tmp_path / "log.sqlite").write_bytes(b"SQLite format 3\x00")
    for given in (tmp_path, tmp_path / "log.sqlite"):
        with pytest.raises(InputError, match=r"log\.sqlite is a log of .* in SQLite; .* `ftqp export` there"):
            load_log(given)
