"""Runs scenarios under several schemes and backends and says side by side what came of each."""

import csv
import io
import json
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ftqp.app.compare.combinations import Combination, file_name
from ftqp.app.output.console import ExitCode, Shown, Table, json_text, progress, table_width
from ftqp.app.output.words import KEPT, fault_sentence
from ftqp.app.run import runs
from ftqp.core.errors import FtqpError, MissingPackage
from ftqp.sim.log.log_file import load_log

Row = Mapping[str, Any]
KINDS = ("scenario", "scheme", "backend")
BEST = "*"
NOTHING = "-"
UNITS = (
    "limits exceeded: q [rad or m], v [rad/s or m/s], a [rad/s2 or m/s2], tau [N m or N]; "
    "comparison.csv and comparison.json: SI units, step times in us"
)
GAP = 2
"""Blanks between two columns of the table on the screen."""
MICRO = 1e-3
"""A column of lengths whose largest is below this is in micrometres [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A column; that of the highest rank goes first where space is short, one of rank 0 never."""

    heading: str
    cells: tuple[str, ...]
    rank: int = 0
    number: bool = True

    @property
    def line(self) -> str:
        """The heading in one line."""
        return self.heading.replace("/\n", "/").replace("\n", " ")

    @property
    def name(self) -> str:
        """The heading without its unit."""
        return self.line.partition(" [")[0]

    @property
    def width(self) -> int:
        """Letters of the longest cell or line of the heading."""
        return max(map(len, (*self.heading.split("\n"), *self.cells)))


def labels(rows: Sequence[Row]) -> tuple[str, list[str]]:
    """What the rows have in common, for a title, and what distinguishes each from the others."""
    kinds = {kind: [str(row["label"][kind]) for row in rows] for kind in KINDS}
    same = {kind: values[0] for kind, values in kinds.items() if len(set(values)) == 1}
    common = ", ".join(value if kind == "scenario" else f"{kind} {value}" for kind, value in same.items())
    telling = [values for kind, values in kinds.items() if kind not in same] or [kinds["backend"]]
    return common, [", ".join(parts) for parts in zip(*telling, strict=True)]


def groups(rows: Sequence[Row]) -> list[list[Row]]:
    """The rows of each table: one a scenario, or all in one when every scenario has a single run."""
    scenarios: dict[str, list[Row]] = {}
    for row in rows:
        scenarios.setdefault(row["label"]["scenario"], []).append(row)
    return [list(rows)] if len(scenarios) == len(rows) else list(scenarios.values())


def columns(rows: Sequence[Row], why: Sequence[str]) -> list[Column]:
    """All columns, of scenario, scheme and backend those that differ; the best completed run is marked."""
    scaled = any(row["ran"] and "SCALED" in row["status_counts"] for row in rows)
    differing = [kind for kind in KINDS if len({row["label"][kind] for row in rows}) > 1]
    return [
        *(
            Column(heading=kind, cells=tuple(str(row["label"][kind]) for row in rows), number=False)
            for kind in differing or ["backend"]
        ),
        Column(heading="result", cells=_results(rows, why), number=False),
        _lengths(rows, "max error", "max_position_error", 0),
        _lengths(rows, "rms error", "rms_position_error", 6),
        Column(heading="limits", cells=_texts(rows, _exceeded), rank=1, number=False),
        Column(heading="failed joint\nmoved [rad]", cells=_texts(rows, _moved), rank=5),
        Column(
            heading=f"relaxed/{'scaled/' if scaled else ''}\nfallback",
            cells=_texts(rows, lambda row: _counts(row, scaled=scaled)),
            rank=2,
        ),
        _times(rows, "p50", 0),
        _times(rows, "p99", 3),
        Column(heading="QP iterations\nmedian/max", cells=_texts(rows, _iterations), rank=4),
    ]


def fitting(table: Sequence[Column], width: int) -> tuple[list[Column], list[Column]]:
    """The columns that fit side by side into ``width`` letters, and those that had to go."""
    kept, gone = list(table), []
    while sum(column.width + GAP for column in kept) - GAP > width:
        last = max(kept, key=lambda column: column.rank)
        if last.rank == 0:
            break
        kept.remove(last)
        gone.append(last)
    return kept, gone


def reasons(rows: Sequence[Row]) -> list[str]:
    """Why runs have no figures, or not all, each once."""
    return list(dict.fromkeys(row["reason"] for row in rows if row["reason"]))


def notes(rows: Sequence[Row]) -> list[str]:
    """What the numbers and marks of the tables mean."""
    why = reasons(rows)
    cells = [cell for group in groups(rows) for column in columns(group, why) for cell in column.cells]
    marked = any(cell.endswith(BEST) for cell in cells)
    lines = [f"({number}) {reason}" for number, reason in enumerate(why, start=1)]
    return [*lines, *([f"{BEST} the best of the completed runs"] if marked else [])]


def markdown(rows: Sequence[Row], figures: Sequence[str]) -> str:
    """All tables as a file to read, with the faults of each scenario and the figures."""
    lines = ["# Comparison"]
    for group in groups(rows):
        table = columns(group, reasons(rows))
        rule = ["---:" if column.number else "---" for column in table]
        body = zip(*(column.cells for column in table), strict=True)
        lines += ["", f"## {labels(group)[0] or 'All runs'}", "", *_about(group)]
        lines += [_line(cells) for cells in ([column.line for column in table], rule, *body)]
    lines += ["", "## Notes", "", *(f"- {_plain(note)}" for note in [*notes(rows), UNITS])]
    lines += ["", "## Figures", "", *(f"![{name}]({name.replace(' ', '%20')})" for name in figures)]
    return "\n".join(lines if figures else lines[:-3]) + "\n"


def _about(rows: Sequence[Row]) -> list[str]:
    """Robot and faults of a table's scenario; nothing for a table of several scenarios."""
    ran = [row for row in rows if row["ran"]]
    if not ran or len({row["label"]["scenario"] for row in rows}) > 1:
        return []
    first = ran[0]
    about = f"{first['robot']}, {first['level']} level, dt {1e3 * first['dt']:g} ms"
    return [about, "", *(f"- {fault_sentence(fault)}" for fault in first["faults"]), ""]


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(_plain(cell.strip()) for cell in cells) + " |"


def _plain(text: str) -> str:
    """``text`` without what Markdown would take for its own."""
    return text.replace("|", "\\|").replace("*", "\\*").replace("_", "\\_")


def _results(rows: Sequence[Row], why: Sequence[str]) -> tuple[str, ...]:
    """How each ended, with the number of its note."""
    numbers = {reason: f" ({number})" for number, reason in enumerate(why, start=1)}
    return tuple(_result(row) + numbers.get(row["reason"], "") for row in rows)


def _result(row: Row) -> str:
    if not row["ran"]:
        return "not run"
    if row["interrupted"]:
        return f"interrupted at {row['steps'] * row['dt']:.4g} s"
    if row["stopped_at"] is not None:
        return f"stopped at {row['stopped_at']:.4g} s"
    return "completed" if row["completed"] else "not completed"


def _texts(rows: Sequence[Row], cell: Callable[[Row], str]) -> tuple[str, ...]:
    return tuple(cell(row) if row["ran"] else NOTHING for row in rows)


def _exceeded(row: Row) -> str:
    """The limits that were exceeded, and by how much; ``kept`` when none was."""
    beyond = [f"{key} by {value:.2g}" for key, value in row["max_limit_violation"].items() if value > KEPT]
    return ", ".join(beyond) or "kept"


def _moved(row: Row) -> str:
    motion = row["max_failed_joint_motion"].values()
    return f"{max(motion):.3g}" if motion else NOTHING


def _counts(row: Row, *, scaled: bool) -> str:
    names = ("RELAXED", "SCALED", "FALLBACK") if scaled else ("RELAXED", "FALLBACK")
    return "/".join(str(row["status_counts"].get(name, 0)) for name in names)


def _iterations(row: Row) -> str:
    median, largest = row["qp"]["iterations_median"], row["qp"]["iterations_max"]
    return f"{median:g}/{largest:g}" if largest else NOTHING


def _lengths(rows: Sequence[Row], what: str, key: str, rank: int) -> Column:
    """A column of lengths in the unit that suits the largest."""
    values = [row[key] if row["ran"] else None for row in rows]
    largest = max((value for value in values if value is not None), default=0.0)
    factor, unit = (1e6, "um") if largest < MICRO else (1e3, "mm")
    texts = [NOTHING if value is None else f"{factor * value:.3g}" for value in values]
    return Column(heading=f"{what}\n[{unit}]", cells=_marked(rows, values, texts), rank=rank)


def _times(rows: Sequence[Row], quantile: str, rank: int) -> Column:
    """A column of step times."""
    values = [row["step_time_us"][quantile] if row["ran"] else None for row in rows]
    texts = [
        NOTHING if value is None else f"{value:.3g}" if value < 100 else f"{value:.0f}" for value in values
    ]
    return Column(heading=f"step {quantile}\n[us]", cells=_marked(rows, values, texts), rank=rank)


def _marked(rows: Sequence[Row], values: Sequence[float | None], texts: Sequence[str]) -> tuple[str, ...]:
    """The texts with a mark at the best completed run of each scenario; no mark where all look the same."""
    best = set()
    for scenario in {row["label"]["scenario"] for row in rows}:
        group = [
            (value, texts[at], at)
            for at, (row, value) in enumerate(zip(rows, values, strict=True))
            if value is not None and row["completed"] and row["label"]["scenario"] == scenario
        ]
        if len({text for _, text, _ in group}) > 1:
            best |= {at for _, text, at in group if text == min(group)[1]}
    if not best:
        return tuple(texts)
    return tuple(f"{text}{BEST if at in best else ' '}" for at, text in enumerate(texts))


NOT_BEGUN = "interrupted before it began"
CUT_SHORT = "interrupted while its files were written"


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """A comparison that has ended; it has failed where files of a run could not be written.

    A row a combination is what ``summary.json`` holds, with ``run`` (its name, and its folder's), ``label``
    (scenario, scheme and backend for a reader), ``ran``, and ``reason`` (why there is no more than that).
    """

    folder: Path
    rows: tuple[dict[str, Any], ...]
    interrupted: bool
    failed: bool
    figures: tuple[Path, ...]

    @property
    def exit_code(self) -> ExitCode:
        """What the process should return: interrupted, or stopped if any run was not completed, or done."""
        if self.interrupted:
            return ExitCode.INTERRUPTED
        completed = all(row["completed"] for row in self.rows if row["ran"])
        return ExitCode.DONE if completed and not self.failed else ExitCode.STOPPED

    def summary(self) -> Shown:
        """The tables, as wide as the terminal allows, and where the files are."""
        why = reasons(self.rows)
        left_out: dict[str, None] = {}
        summary: list[str | Table] = []
        for group in groups(self.rows):
            table = columns(group, why)
            shown, gone = fitting(table, table_width())
            left_out |= {column.name: None for column in gone}
            heads, numbers = [one.heading for one in shown], [one.heading for one in shown if one.number]
            rows = list(zip(*(one.cells for one in shown), strict=True))
            summary.append(Table(labels(group)[0], heads, rows, numbers))
        summary += notes(self.rows)
        if left_out:
            summary.append(f"not shown for lack of space: {', '.join(left_out)}; comparison.md has them")
        return [*summary, f"files: {self.folder}"]


def compare(combinations: Sequence[Combination], folder: Path, *, drawn: bool = True) -> Comparison:
    """Runs what can run, one after the other, and writes everything below ``folder``."""
    runs.make_folder(folder)
    rows, interrupted, failed = _rows(combinations, folder, drawn)
    _write(folder, rows, ())
    figures: tuple[Path, ...] = ()
    if drawn and not interrupted:
        try:
            figures = _figures(folder, rows)
        except KeyboardInterrupt:
            interrupted = True
        _write(folder, rows, figures)
    return Comparison(
        folder=folder, rows=tuple(rows), interrupted=interrupted, failed=failed, figures=figures
    )


def _rows(
    combinations: Sequence[Combination], folder: Path, drawn: bool
) -> tuple[list[dict[str, Any]], bool, bool]:
    """One row a combination, whether Ctrl-C came, and whether a run broke off."""
    rows: list[dict[str, Any]] = []
    todo = sum(combination.setup is not None for combination in combinations)
    done, doing, interrupted, failed = 0, "", False, False
    with progress(lambda: doing, float(todo)) as advance:
        for combination in combinations:
            facts: dict[str, Any] = {}
            reason = NOT_BEGUN if interrupted else combination.reason
            if combination.setup is not None and not interrupted:
                doing = f"{done + 1} of {todo}: {combination.name}"
                try:
                    run = runs.run(
                        combination.setup,
                        folder / combination.name,
                        advance=partial(_advanced, advance, done),
                        drawn=drawn,
                    )
                    facts, interrupted = run.summary, run.summary["interrupted"]
                except KeyboardInterrupt:
                    interrupted, reason = True, CUT_SHORT
                    facts = _kept(folder / combination.name)
                except FtqpError as error:
                    failed, reason = True, str(error)
                done += 1
            rows.append(_row(combination, facts, reason))
    return rows, interrupted, failed


def _advanced(advance: Callable[[float], None], done: int, share: float) -> None:
    """Tell that so many runs and a share of the next are done."""
    advance(done + share)


def _kept(folder: Path) -> dict[str, Any]:
    """What a run cut short had already written about itself."""
    file = folder / runs.SUMMARY
    facts: dict[str, Any] = json.loads(file.read_text("utf-8")) if file.is_file() else {}
    return facts


def _row(combination: Combination, facts: Mapping[str, Any], reason: str) -> dict[str, Any]:
    label = {key: getattr(combination, key) for key in ("scenario", "scheme", "backend")}
    about = {"run": combination.name, "label": label, "ran": bool(facts), "reason": reason or None}
    return {**about, **(facts or {**label, "completed": False, "steps": 0})}


def _figures(folder: Path, rows: Sequence[Mapping[str, Any]]) -> tuple[Path, ...]:
    """Pictures of the runs of each arm and path side by side; none, with a note, without matplotlib."""
    try:
        from ftqp.viz.figures.compared_runs import save_comparison
    except MissingPackage:
        return ()  # the first run has said it
    files: list[Path] = []
    courses: dict[str, list[Row]] = {}
    for row in rows:
        if row["ran"]:
            courses.setdefault(_course(folder / row["run"]), []).append(row)
    with progress("figures", float(len(courses))) as advance:
        for done, own in enumerate(courses.values()):
            advance(float(done))
            common, names = labels(own)
            logs = {label: load_log(folder / row["run"]) for label, row in zip(names, own, strict=True)}
            scenarios = list(dict.fromkeys(row["label"]["scenario"] for row in own))
            title = common if len(scenarios) == 1 else f"{' and '.join(scenarios)}, {common}"
            files += save_comparison(
                logs, folder / "figures", name=file_name("+".join(scenarios)), title=title
            )
    return tuple(files)


def _course(run: Path) -> str:
    """Arm, start and path of a run, by which scenarios are drawn in one figure."""
    scenario = tomllib.loads((run / runs.SCENARIO).read_text("utf-8"))
    return json_text({table: scenario.get(table) for table in ("robot", "start", "path")})


def _write(folder: Path, rows: Sequence[Mapping[str, Any]], figures: Sequence[Path]) -> None:
    """The rows for a program (JSON), for a spreadsheet (CSV) and for a reader (Markdown)."""
    pictures = [str(figure.relative_to(folder)) for figure in figures]
    texts = {
        "comparison.json": json_text({"runs": list(rows)}),
        "comparison.csv": _csv(rows),
        "comparison.md": markdown(rows, pictures),
    }
    for name, text in texts.items():
        runs.write(folder / name, text)


def _csv(rows: Sequence[Mapping[str, Any]]) -> str:
    """One line a run; the keys of the summary as columns, nested ones with a dot, SI units."""
    flat = [_flat(row) for row in rows]
    text = io.StringIO()
    writer = csv.DictWriter(text, dict.fromkeys(key for row in flat for key in row), lineterminator="\n")
    writer.writeheader()
    writer.writerows(flat)
    return text.getvalue()


def _flat(row: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in row.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{key}.")
        elif not isinstance(value, list):
            flat[f"{prefix}{key}"] = value
    return flat
