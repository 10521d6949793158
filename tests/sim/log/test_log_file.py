import json
import os
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import textwrap
from contextlib import closing

import numpy as np
import pytest

from ftqp.core.errors import FtqpError, InputError
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.log_writer import LogWriter
from ftqp.sim.log.raw_rows import BLOCK
from ftqp.sim.log.row_sink import MemoryRows
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


def execute(path, *statements):
    with closing(sqlite3.connect(path)) as connection:
        for statement in statements:
            connection.execute(*((statement,) if isinstance(statement, str) else statement))
        connection.commit()


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
    assert log.metadata["scenario"] == {"robot": {"name": "panda"}}
    assert (log.metadata["format"], log.metadata["dt"]) == (2, 0.1)


def test_log_in_memory_is_the_same_as_the_file(tmp_path):
    write(tmp_path / "log.sqlite", BLOCK + 5)
    kept = MemoryRows(COLUMNS, {"state": "running"})
    for first in (0, BLOCK, BLOCK):
        kept.write(first, rows(first, BLOCK if first == 0 else 5))
    kept.annotate({"state": "finished"})
    file = load_log(tmp_path / "log.sqlite")
    assert kept.log.names == file.names and kept.log.units == file.units
    for name in file.names:
        np.testing.assert_array_equal(kept.log[name], file[name])
        assert kept.log[name].dtype == file[name].dtype
    assert kept.log.metadata == {"state": "finished"} and kept.log.path is None
    with pytest.raises(InputError, match="'x' is not a signal of log in memory"):
        kept.log["x"]


def test_any_python_reads_the_rows_as_the_file_itself_says(tmp_path):
    write(tmp_path / "log.sqlite", BLOCK + 4)
    with closing(sqlite3.connect(tmp_path / "log.sqlite")) as connection:
        (recipe,) = connection.execute("SELECT value FROM metadata WHERE key = 'reading'").fetchone()
        found = {"connection": connection, "numpy": np}
        exec(json.loads(recipe), found)
    assert found["names"] == ["t", "q.a", "q.b", "status"]
    np.testing.assert_array_equal(found["table"], rows(0, BLOCK + 4))


@pytest.mark.parametrize("joints", [("j1", "J1"), ('"', '""'), ("a'b", "a b; DROP TABLE chunks"), ("ä", "")])
def test_joints_may_be_called_anything(tmp_path, joints):
    signals = [Column("t", "s", "time"), *(Column(f"q.{joint}", "rad", "position") for joint in joints)]
    with LogWriter(tmp_path / "l.sqlite", signals, {"joints": joints}) as log:
        log.write(0, np.array([[0.0, 1.0, 2.0]]))
    log = load_log(tmp_path / "l.sqlite")
    np.testing.assert_array_equal(log["q"], [[1.0, 2.0]])
    assert log[f"q.{joints[1]}"] == 2.0


def test_name_of_nineteen_megabytes_is_refused():
    with pytest.raises(InputError, match="has a name of 19000002 letters, expected at most 200"):
        columns(["x" * 19_000_000], np.array([False]), "velocity")


@pytest.mark.long
def test_killed_process_leaves_a_readable_log(tmp_path):
    path = tmp_path / "log.sqlite"
    script = textwrap.dedent(
        f"""
        import numpy as np, sys
        from ftqp.sim.log.log_writer import LogWriter
        from ftqp.sim.log.signals import Column
        log = LogWriter({str(path)!r}, [Column("t", "s", "time")], {{"dt": 0.01}})
        k = 0
        while True:
            log.write(k, 0.01 * np.arange(k, k + 7)[:, None])
            k += 7
            print(k, flush=True)
        """
    )
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    for line in process.stdout:
        if int(line) >= 700:
            process.send_signal(signal.SIGKILL)
            break
    process.wait()
    process.stdout.close()
    log = load_log(path)
    assert len(log) >= 700
    np.testing.assert_array_equal(log["t"], 0.01 * np.arange(len(log)))
    assert log.metadata["dt"] == 0.01


def test_log_of_a_writer_killed_in_the_middle_of_a_write_is_put_in_order(tmp_path):
    write(tmp_path / "whole.sqlite", 10)
    connection = sqlite3.connect(tmp_path / "whole.sqlite", isolation_level=None)
    connection.execute("PRAGMA cache_size = 1")
    connection.execute("PRAGMA cache_spill = 1")
    connection.execute("BEGIN")
    connection.execute("INSERT INTO chunks VALUES (10, 2048, 0, zeroblob(65536))")
    connection.execute("UPDATE chunks SET crc = 0 WHERE first = 0")
    for name in ("whole.sqlite", "whole.sqlite-journal"):
        shutil.copy(tmp_path / name, tmp_path / name.replace("whole", "cut"))
    connection.close()
    assert (tmp_path / "cut.sqlite-journal").stat().st_size > 0
    np.testing.assert_array_equal(load_log(tmp_path / "cut.sqlite")["q.a"], np.arange(10))


def test_reading_leaves_the_file_as_it_is(tmp_path):
    write(tmp_path / "l.sqlite", 10)
    before = (tmp_path / "l.sqlite").read_bytes()
    (tmp_path / "l.sqlite").chmod(0o400)
    assert len(load_log(tmp_path / "l.sqlite")) == 10
    assert (tmp_path / "l.sqlite").read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["l.sqlite"]


def test_write_takes_the_place_of_one_that_was_interrupted(tmp_path):
    with LogWriter(tmp_path / "l.sqlite", COLUMNS, {}) as log:
        log.write(0, rows(0, 3))
        log.write(0, rows(0, 3))
        log.write(3, rows(3, 1))
    np.testing.assert_array_equal(load_log(tmp_path / "l.sqlite")["q.a"], [0, 1, 2, 3])


def test_existing_file_is_never_overwritten(tmp_path):
    write(tmp_path / "l.sqlite", 1)
    with pytest.raises(InputError, match="exists already; choose another folder"):
        LogWriter(tmp_path / "l.sqlite", COLUMNS, {})
    assert [file.name for file in tmp_path.iterdir()] == ["l.sqlite"] and len(
        load_log(tmp_path / "l.sqlite")
    ) == 1
    (tmp_path / "link.sqlite").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="exists already; choose another folder"):
        LogWriter(tmp_path / "link.sqlite", COLUMNS, {})


def test_file_that_cannot_be_made_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match="cannot be made"):
        LogWriter(tmp_path / "none" / "l.sqlite", COLUMNS, {})


def test_full_disk_is_an_error(tmp_path):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    with LogWriter(tmp_path / "l.sqlite", COLUMNS, {"state": "running"}) as log:
        log.write(0, rows(0, BLOCK))
        resource.setrlimit(resource.RLIMIT_FSIZE, ((tmp_path / "l.sqlite").stat().st_size, hard))
        try:
            with pytest.raises(FtqpError, match="cannot be written"):
                log.write(BLOCK, rows(BLOCK, BLOCK))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    log = load_log(tmp_path / "l.sqlite")
    assert (len(log), log.metadata["state"]) == (BLOCK, "running")


@pytest.mark.parametrize("content", [b"hello, I am text", b"\x00" * 4096, b"", b"SQLite format 3\x00" * 300])
def test_file_that_is_not_a_log_is_refused(tmp_path, content):
    (tmp_path / "x.sqlite").write_bytes(content)
    with pytest.raises(InputError, match="is not a log of ftqp"):
        load_log(tmp_path / "x.sqlite")


def test_ten_gigabytes_of_nothing_are_refused(tmp_path):
    with (tmp_path / "x.sqlite").open("wb") as file:
        file.truncate(10_000_000_000)
    with pytest.raises(InputError, match="is not a log of ftqp"):
        load_log(tmp_path / "x.sqlite")
    write(tmp_path / "y.sqlite", 3)
    os.truncate(tmp_path / "y.sqlite", 10_000_000_000)
    assert len(load_log(tmp_path / "y.sqlite")) == 3


BLOB = rows(0, 2).tobytes()
DAMAGES = {
    "view in place of a table": (
        ["DROP TABLE chunks", "CREATE VIEW chunks AS SELECT 0 AS first, 0 AS rows, 0 AS crc, x'' AS data"],
        "it has no table",
    ),
    "endless view": (
        [
            "DROP TABLE metadata",
            "CREATE VIEW metadata AS WITH RECURSIVE r(key) AS (SELECT 1 UNION ALL SELECT key + 1 FROM r) "
            "SELECT key, '0' AS value FROM r",
        ],
        "it has no table metadata",
    ),
    "other columns": (["ALTER TABLE chunks ADD COLUMN more"], "it has no table chunks as a log has it"),
    "no signals": (["DELETE FROM columns"], "it has no signals"),
    "declared rows": (["UPDATE chunks SET rows = 1000000000000"], "does not follow"),
    "declared bytes": (["UPDATE chunks SET data = zeroblob(100000000)"], "has 100000000 bytes, expected 64"),
    "text for numbers": (["UPDATE chunks SET data = 'abc'"], "bytes, expected 64"),
    "gap": (["UPDATE chunks SET first = 5"], "does not follow"),
    "flipped bit": ([("UPDATE chunks SET data = ?", (BLOB[:-1] + b"\x01",))], "checksum differs"),
    "metadata": (["INSERT INTO metadata VALUES ('dt', '{')"], ""),
    "deep metadata": ([("INSERT INTO metadata VALUES ('dt', ?)", ("[" * 100_000,))], ""),
    "large metadata": (
        [("INSERT INTO metadata VALUES ('dt', ?)", ('"' + "9" * 20_000_000 + '"',))],
        "too big",
    ),
    "later format": (["UPDATE metadata SET value = '3' WHERE key = 'format'"], "it has format 3"),
    "long name": ([("UPDATE columns SET name = ? WHERE place = 0", ("t" * 1000,))], "name of 1000 letters"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_log_is_refused_in_a_sentence(tmp_path, damage):
    statements, sentence = DAMAGES[damage]
    write(tmp_path / "l.sqlite", 2)
    execute(tmp_path / "l.sqlite", *statements)
    with pytest.raises(InputError, match=f"l.sqlite is not a log of ftqp: .*{sentence}") as caught:
        load_log(tmp_path / "l.sqlite")
    assert len(str(caught.value)) < 400


def first_format(path, *more):
    execute(
        path,
        'CREATE TABLE log (k INTEGER PRIMARY KEY, "t" REAL, "q.a" REAL, "q.b" REAL, "status" INTEGER)',
        "CREATE TABLE columns (name TEXT PRIMARY KEY, unit TEXT, description TEXT)",
        "CREATE TABLE metadata (key TEXT PRIMARY KEY, value TEXT)",
        *(("INSERT INTO columns VALUES (?, ?, ?)", (c.name, c.unit, c.description)) for c in COLUMNS),
        "INSERT INTO metadata VALUES ('format', '1')",
        *(("INSERT INTO log VALUES (?, ?, ?, ?, ?)", (k, *row)) for k, row in enumerate(rows(0, 5).tolist())),
        *more,
    )


def test_log_of_the_first_format_is_read_like_one_of_the_second(tmp_path):
    first_format(tmp_path / "old.sqlite")
    write(tmp_path / "new.sqlite", 5)
    old, new = load_log(tmp_path / "old.sqlite"), load_log(tmp_path / "new.sqlite")
    assert old.names == new.names and old.units == new.units
    for name in new.names:
        np.testing.assert_array_equal(old[name], new[name])
        assert old[name].dtype == new[name].dtype


@pytest.mark.parametrize(
    "damage",
    [
        ["UPDATE log SET t = 'soon'"],
        ["UPDATE log SET t = zeroblob(1000000)"],
        ["DROP TABLE log", "CREATE VIEW log AS SELECT 0 AS k, 1.0 AS t"],
        ["DELETE FROM columns"],
        ["UPDATE columns SET name = NULL"],
    ],
)
def test_damaged_log_of_the_first_format_is_refused(tmp_path, damage):
    first_format(tmp_path / "old.sqlite", *damage)
    with pytest.raises(InputError, match="is not a log of ftqp"):
        load_log(tmp_path / "old.sqlite")


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


def test_columns_have_units_of_their_joints():
    units = {c.name: c.unit for c in columns(["turn", "slide"], np.array([False, True]), "velocity")}
    assert (units["q.turn"], units["q.slide"]) == ("rad", "m")
    assert (units["a.turn"], units["a.slide"]) == ("rad/s2", "m/s2")
    assert (units["tau.turn"], units["tau.slide"]) == ("N m", "N")
    assert units["lb.slide"] == "m/s"
