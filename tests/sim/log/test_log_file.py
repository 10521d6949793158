import csv
import os
import signal
import sqlite3
import subprocess
import sys
import textwrap

import numpy as np
import pytest

from ftqp.core.errors import FtqpError, InputError
from ftqp.sim.log.log_file import BLOCK, LogWriter, load_log
from ftqp.sim.log.signals import Column, columns

COLUMNS = [
    Column("t", "s", "time"),
    Column("q.a", "rad", "position"),
    Column("q.b", "rad", "position"),
    Column("status", "-", "code", True),
]


def write(path, count, metadata=None):
    with LogWriter(path, COLUMNS, metadata or {}) as log:
        for k in range(count):
            log.row[:] = (k * 0.1, k, -k, k % 3)
            log.append()


@pytest.mark.parametrize("count", [0, 1, BLOCK, 2 * BLOCK + 7])
def test_log_gives_back_what_was_written(tmp_path, count):
    write(tmp_path / "log.sqlite", count, {"scenario": {"robot": {"name": "panda"}}, "dt": 0.1})
    log = load_log(tmp_path / "log.sqlite")
    k = np.arange(count)
    assert len(log) == count
    assert log.names == ("t", "q.a", "q.b", "status")
    np.testing.assert_array_equal(log["t"], k * 0.1)
    np.testing.assert_array_equal(log["q"], np.stack([k, -k], axis=1))
    np.testing.assert_array_equal(log["status"], k % 3)
    assert log["status"].dtype == np.int64
    assert log.units["q.a"] == "rad"
    assert log.descriptions["t"] == "time"
    assert log.metadata == {"scenario": {"robot": {"name": "panda"}}, "dt": 0.1}


def test_folder_of_a_run_is_as_good_as_its_file(tmp_path):
    write(tmp_path / "log.sqlite", 3)
    assert len(load_log(tmp_path)) == 3


def test_values_that_are_not_numbers_survive(tmp_path):
    with LogWriter(tmp_path / "l.sqlite", COLUMNS, {}) as log:
        log.row[:] = (0.0, np.nan, np.inf, 0)
        log.append()
    log = load_log(tmp_path / "l.sqlite")
    assert np.isnan(log["q.a"][0])
    assert np.isinf(log["q.b"][0])


def test_any_tool_can_read_the_file(tmp_path):
    write(tmp_path / "log.sqlite", 4)
    rows = sqlite3.connect(tmp_path / "log.sqlite").execute('SELECT "q.a" FROM log WHERE t > 0.15').fetchall()
    assert rows == [(2.0,), (3.0,)]


def test_killed_process_leaves_a_readable_log_up_to_its_last_second(tmp_path):
    path = tmp_path / "log.sqlite"
    script = textwrap.dedent(
        f"""
        import time
        from ftqp.sim.log.log_file import LogWriter
        from ftqp.sim.log.signals import Column
        log = LogWriter({str(path)!r}, [Column("t", "s", "time")], {{"dt": 0.01}})
        k = 0
        while True:
            log.row[0] = k * 0.01
            log.append()
            k += 1
            time.sleep(0.01)
            print(k, flush=True)
        """
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, env=dict(os.environ), text=True
    )
    assert process.stdout is not None
    for line in process.stdout:
        if int(line) == 150:
            process.send_signal(signal.SIGKILL)
            break
    process.wait()
    process.stdout.close()
    log = load_log(path)
    assert 40 <= len(log) <= 150
    np.testing.assert_array_equal(log["t"], np.arange(len(log)) * 0.01)
    assert log.metadata["dt"] == 0.01


def test_flush_can_be_repeated_after_an_interruption(tmp_path):
    log = LogWriter(tmp_path / "l.sqlite", COLUMNS, {})
    log.row[:] = (1.0, 2.0, 3.0, 4)
    log.append()
    log._connection.execute("BEGIN")
    log._connection.execute("INSERT INTO log VALUES (0, 9, 9, 9, 9)")
    log.close()
    np.testing.assert_array_equal(load_log(tmp_path / "l.sqlite")["t"], [1.0])


def test_metadata_can_be_added_later(tmp_path):
    with LogWriter(tmp_path / "l.sqlite", COLUMNS, {"state": "running"}) as log:
        log.annotate({"state": "finished"})
    assert load_log(tmp_path / "l.sqlite").metadata == {"state": "finished"}


def test_existing_file_is_never_overwritten(tmp_path):
    write(tmp_path / "l.sqlite", 1)
    with pytest.raises(InputError, match="exists already; choose another folder"):
        LogWriter(tmp_path / "l.sqlite", COLUMNS, {})


def test_file_that_cannot_be_made_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match="cannot be made"):
        LogWriter(tmp_path / "none" / "l.sqlite", COLUMNS, {})


def test_file_that_cannot_be_written_any_more_is_an_error(tmp_path):
    log = LogWriter(tmp_path / "l.sqlite", COLUMNS, {})
    log._connection.execute("DROP TABLE log")
    log.append()
    with pytest.raises(FtqpError, match="cannot be written"):
        log.flush()
    log._connection.close()


@pytest.mark.parametrize("content", [b"hello, I am text", b"\x00" * 4096, b""])
def test_file_that_is_not_a_log_is_refused(tmp_path, content):
    (tmp_path / "x.sqlite").write_bytes(content)
    with pytest.raises(InputError, match="is not a log of ftqp"):
        load_log(tmp_path / "x.sqlite")


def test_missing_log_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"log .*x.sqlite does not exist"):
        load_log(tmp_path / "x.sqlite")
    with pytest.raises(InputError, match=r"log .*log.sqlite does not exist"):
        load_log(tmp_path)


def test_unknown_signal_names_the_known_ones(tmp_path):
    write(tmp_path / "l.sqlite", 1)
    with pytest.raises(
        InputError, match=r"'statos' is not a signal of log .* \(did you mean 'status'\?\); it has t, q, "
    ):
        load_log(tmp_path / "l.sqlite")["statos"]


def test_csv_holds_every_signal(tmp_path):
    write(tmp_path / "l.sqlite", 3)
    load_log(tmp_path / "l.sqlite").to_csv(tmp_path / "l.csv")
    with (tmp_path / "l.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["t", "q.a", "q.b", "status"]
    assert [float(x) for x in rows[3]] == [0.2, 2.0, -2.0, 2.0]
    with pytest.raises(InputError, match="exists already"):
        load_log(tmp_path / "l.sqlite").to_csv(tmp_path / "l.csv")
    with pytest.raises(InputError, match="cannot be written"):
        load_log(tmp_path / "l.sqlite").to_csv(tmp_path / "none" / "l.csv")


def test_columns_have_units_of_their_joints():
    units = {c.name: c.unit for c in columns(["turn", "slide"], np.array([False, True]), "velocity")}
    assert (units["q.turn"], units["q.slide"]) == ("rad", "m")
    assert (units["a.turn"], units["a.slide"]) == ("rad/s2", "m/s2")
    assert (units["tau.turn"], units["tau.slide"]) == ("N m", "N")
    assert units["lb.slide"] == "m/s"


def test_columns_are_all_different_and_described():
    all_columns = columns(["a", "b"], np.array([False, False]), "acceleration")
    assert len({c.name for c in all_columns}) == len(all_columns)
    assert all(c.description and c.unit for c in all_columns)
