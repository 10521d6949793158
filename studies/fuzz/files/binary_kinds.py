"""Kinds of files that programs write: logs, plans, results of studies, and what lies beside them in JSON."""

import contextlib
import copy
import io
import json
import shutil
import sqlite3
import tempfile
import warnings
import zipfile
from contextlib import closing
from functools import cache
from pathlib import Path
from random import Random
from typing import Any, Final
from unittest import mock

import numpy as np

from ftqp.analysis.planning import fault_plan
from ftqp.app.campaign.episode_study import COLUMNS, KIND
from ftqp.app.campaign.kept_campaign import kept_campaign
from ftqp.app.commands import campaign_section
from ftqp.app.commands.exporting import FORMATS, export
from ftqp.app.commands.reporting import sentences
from ftqp.app.run import runs
from ftqp.app.scenario.setup import load
from ftqp.app.study.results_file import FILE_NAME as RESULTS
from ftqp.app.study.results_file import ResultsFile
from ftqp.app.view.replay_source import ReplaySource
from ftqp.app.view.verdicts_file import VERDICTS, read_verdicts
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.log_writer import FILE_NAME
from ftqp.sim.session.session_commands import Seek
from fuzz.files.grammar import NUMBERS, WORDS, anything, spoiled
from fuzz.files.kinds import Case, few_ticks, json_text
from fuzz.files.workshop import CALIBRATION, CAMPAIGN, COVERAGE, HEALTHY, KEY, PLAN, RUN, SCENARIO, workshop

DRAWN: Final = 0.03
"""Share of the reports whose pictures are drawn, which takes a second."""
ENDLESS: Final = "WITH RECURSIVE c(x) AS (SELECT 0 UNION ALL SELECT x + 1 FROM c) SELECT"
"""The beginning of a query that never ends."""


def log(rng: Random, folder: Path) -> Case:
    """The log of a run: looked at, told in words, played, and written in one of the forms of export."""
    file = folder / FILE_NAME
    for name in (file.name, file.with_suffix(".json").name):
        shutil.copy(workshop() / RUN / name, folder / name)
    if rng.random() < 0.3:
        _spoil_bytes(file, rng)
    else:
        about = file.with_suffix(".json")
        content = json.loads(about.read_text(encoding="utf-8"))
        spoiled(content, rng)
        about.write_text(json.dumps(content, default=str), encoding="utf-8")
    form = rng.choice([name for name in FORMATS if name != "mcap" or rng.random() < 0.3])

    def use() -> None:
        found = load_log(file)
        for name in found.rows.groups():
            found[name]
        if len(found):
            sentences(found)
        hush = io.StringIO()
        silent = contextlib.redirect_stdout(hush), contextlib.redirect_stderr(hush)
        with tempfile.TemporaryDirectory() as other, silent[0], silent[1]:
            export(str(file), form, Path(other) / "out", as_json=True)
        source = ReplaySource(found, "a run")
        for t in (0.0, 0.1, 0.2):
            source.put(Seek(t))
            source.frame()

    return Case(file, use)


def results(rng: Random, folder: Path) -> Case:
    """The results of a study: gone on with, and read for a report."""
    shutil.copytree(workshop() / CAMPAIGN, folder / "study")
    file = folder / "study" / RESULTS
    _spoil_database(file, rng, _of_results)
    goes_on, drawn = rng.random() < 0.5, rng.random() < DRAWN

    def use() -> None:
        if goes_on:
            with ResultsFile(folder / "study", kind=KIND, key=KEY, columns=COLUMNS) as found:
                found.done(), found.count(), found.seconds(), found.crashed(), found.table()
                found.write([7], [tuple(None for _ in COLUMNS)], 1.0, "me")
        else:
            _reported(folder / "study", drawn)

    return Case(folder / "nothing", use)


def _reported(folder: Path, drawn: bool) -> None:
    """The section of a report on a campaign, with pictures or without."""
    facts = kept_campaign(folder)
    if facts is None:
        return
    with (
        contextlib.nullcontext()
        if drawn
        else mock.patch.object(campaign_section, "_pictures", lambda facts: [])
    ):
        campaign_section.campaign_parts("campaign", facts, folder)


def _spoil_bytes(file: Path, rng: Random) -> None:
    """Cut, made longer, or with other bytes."""
    data = bytearray(file.read_bytes())
    change = rng.randrange(4)
    if change == 0:
        data = data[: rng.randrange(len(data) + 1)]
    elif change == 1:
        data += bytes(rng.randrange(256) for _ in range(rng.randrange(5000)))
    else:
        for _ in range(rng.choice((1, 5, 200))):
            data[rng.randrange(len(data) if change == 2 else 4096)] = rng.randrange(256)
    file.write_bytes(data)


def _spoil_database(file: Path, rng: Random, by_statement: Any) -> None:
    """As bytes, or as tables."""
    if rng.random() < 0.15:
        _spoil_bytes(file, rng)
        return
    with closing(sqlite3.connect(file, isolation_level=None)) as connection:
        connection.execute("PRAGMA journal_mode = DELETE")
        for _ in range(rng.choice((1, 1, 2))):
            with contextlib.suppress(sqlite3.Error, OverflowError, UnicodeError, ValueError, TypeError):
                by_statement(connection, rng)


def _of_results(connection: sqlite3.Connection, rng: Random) -> None:
    """One change of results by their own rules."""
    change = rng.randrange(8)
    if change < 3:
        column = rng.choice(
            ("item", "drawn", "outcome", "ticks", "largest_ok_error", "sentences", "seconds", "worker")
        )
        value = rng.choice((*WORDS, None, b"\xff", -1, 2**62, 1e308, float("inf"), "broken", "raised"))
        where = rng.choice(("", " WHERE item = 1"))
        connection.execute(f"UPDATE results SET {column} = ?{where}", (value,))
    elif change < 5:
        value = rng.choice(
            (json.dumps(anything(rng), default=str), None, b"\xff", "[" * 5000, "2", "true", "1e999")
        )
        key = rng.choice(("format", "kind", "key", "study", "ftqp"))
        connection.execute("INSERT OR REPLACE INTO about VALUES (?, ?)", (key, value))
    elif change == 5:
        connection.execute(f"DELETE FROM {rng.choice(('about', 'results', 'crashed'))}")
    else:
        _spoil_tables(connection, rng, ("about", "results", "crashed"))


def _spoil_tables(connection: sqlite3.Connection, rng: Random, names: tuple[str, ...]) -> None:
    """Tables dropped, renamed, made anew otherwise, replaced by views without end, guarded by triggers."""
    name, change = rng.choice(names), rng.randrange(6)
    columns = [row[1] for row in connection.execute(f"PRAGMA table_info({name})")]
    if change == 0:
        connection.execute(f"DROP TABLE {name}")
    elif change == 1:
        connection.execute(f"ALTER TABLE {name} RENAME TO {rng.choice(('x', 'log', 'view_1'))}")
    elif change == 2:
        connection.execute(f"DROP TABLE {name}")
        connection.execute(
            f"CREATE VIEW {name} AS {ENDLESS} {', '.join(f'x AS {c}' for c in columns)} FROM c"
        )
    elif change == 3:
        connection.execute(f"ALTER TABLE {name} ADD COLUMN more TEXT")
    elif change == 4:
        connection.execute(f"CREATE TRIGGER t AFTER INSERT ON {name} BEGIN DELETE FROM {name}; END")
    else:
        (said,) = connection.execute("SELECT sql FROM sqlite_master WHERE name = ?", (name,)).fetchone()
        connection.execute("PRAGMA writable_schema = ON")
        view = f"CREATE VIEW {name} AS {ENDLESS} {', '.join(f'x AS {c}' for c in columns)} FROM c"
        put = rng.choice((view, said.replace("TEXT", "BLOB"), f"{said} -- x", "x"))
        connection.execute("UPDATE sqlite_master SET sql = ? WHERE name = ?", (put, name))


def plan(rng: Random, folder: Path) -> Case:
    """A plan, which then leads a planner for a few ticks."""
    file = folder / "plan.npz"
    if rng.random() < 0.2:  # bytes
        data = bytearray((workshop() / PLAN).read_bytes())
        for _ in range(rng.choice((1, 3, 50))):
            data[rng.randrange(len(data))] = rng.randrange(256)
        file.write_bytes(data[: rng.choice((len(data), rng.randrange(len(data))))])
    else:
        _write_plan(file, rng)
    return Case(file, lambda: few_ticks(load(SCENARIO, HEALTHY, plan=file)))


@cache
def _whole_plan() -> tuple[dict[str, Any], dict[str, Any]]:
    return fault_plan.read_plan(workshop() / PLAN)


def _write_plan(file: Path, rng: Random) -> None:
    """Other arrays and another text, with a hash that is right where it can be."""
    arrays, about = copy.deepcopy(_whole_plan())
    for _ in range(rng.randint(0, 2)):
        name = rng.choice(list(arrays))
        arrays[name] = _other_array(arrays[name], rng)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # complex numbers lose a part
            content = fault_plan._content(arrays)
    except (TypeError, ValueError, OverflowError):
        content = ""
    about = {"format": 1, **about, "content": content}
    if rng.random() < 0.6:
        spoiled(about, rng)
        if rng.random() < 0.7:
            about["content"] = content
    text: Any = json.dumps(about, default=str)
    if rng.random() < 0.1:
        text = rng.choice(("", "[" * 5000, "1" * 6000, "null", '{"format": 1}', text[:50]))
    arrays["about"] = np.array(text) if rng.random() < 0.95 else np.array([text, text])
    if rng.random() < 0.1:
        del arrays[rng.choice(list(arrays))]
    with zipfile.ZipFile(
        file, "w", rng.choice((zipfile.ZIP_DEFLATED, zipfile.ZIP_STORED, zipfile.ZIP_LZMA))
    ) as out:
        for name, value in arrays.items():
            with out.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, np.asarray(value), allow_pickle=True)


def _other_array(value: Any, rng: Random) -> Any:
    """Another number, another shape, another type."""
    value = np.array(value)
    change = rng.randrange(7)
    if change < 3 and value.size:
        value.flat[rng.randrange(value.size)] = rng.choice([x for x in NUMBERS if isinstance(x, float)])
        return value
    if change == 3:
        return value[: rng.randrange(len(value) + 1)]
    if change == 4:
        return value.astype(rng.choice(("<f4", ">f8", "<i8", "U8", "complex128", "object", "bool", "f2")))
    if change == 5:
        return rng.choice((value.T, value[..., :1], value.reshape(-1), np.zeros(0), np.zeros((0, 3))))
    with np.errstate(over="ignore"):
        return value * rng.choice((1e-9, 1.001, 1e9, 1e300))


def verdicts(rng: Random, folder: Path) -> Case:
    """The verdicts of a coverage report."""
    shutil.copytree(workshop() / COVERAGE, folder / COVERAGE)
    file = folder / COVERAGE / VERDICTS
    file.write_bytes(json_text(json.loads(file.read_text("utf-8")), rng))
    return Case(file, lambda: read_verdicts(folder / COVERAGE))


def calibration(rng: Random, folder: Path) -> Case:
    """What a detector knows of an arm, which is then watched by it for a few ticks."""
    file = folder / CALIBRATION
    file.write_bytes(json_text(json.loads((workshop() / CALIBRATION).read_text("utf-8")), rng))
    chosen = [
        f"planner.detector.calibration={file}",
        "planner.detector.bandwidths=[5.0, 50.0]",
        "planner.drive=position",
    ]
    return Case(file, lambda: few_ticks(load("panda-detected", chosen)))


def summary(rng: Random, folder: Path) -> Case:
    """The summary of a campaign, of which a report is made."""
    shutil.copytree(workshop() / CAMPAIGN, folder / CAMPAIGN)
    file = folder / CAMPAIGN / runs.SUMMARY
    file.write_bytes(json_text(json.loads(file.read_text("utf-8")), rng))
    drawn = rng.random() < DRAWN

    def use() -> None:
        _reported(folder / CAMPAIGN, drawn)

    return Case(file, use)
