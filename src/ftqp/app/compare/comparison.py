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

from ftqp.app.compare import comparison_table
from ftqp.app.compare.combinations import Combination, file_name
from ftqp.app.output.console import ExitCode, Table, Told, json_text, progress, table_width
from ftqp.app.run import runs
from ftqp.core.errors import FtqpError, MissingPackage
from ftqp.sim.log.log_file import load_log

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

    def told(self) -> Told:
        """The tables, as wide as the terminal allows, and where the files are."""
        why = comparison_table.reasons(self.rows)
        left_out: dict[str, None] = {}
        told: list[str | Table] = []
        for group in comparison_table.groups(self.rows):
            table = comparison_table.columns(group, why)
            shown, gone = comparison_table.fitting(table, table_width())
            left_out |= {column.name: None for column in gone}
            heads, numbers = [one.heading for one in shown], [one.heading for one in shown if one.number]
            rows = list(zip(*(one.cells for one in shown), strict=True))
            told.append(Table(comparison_table.labels(group)[0], heads, rows, numbers))
        told += comparison_table.notes(self.rows)
        if left_out:
            told.append(f"not shown for lack of space: {', '.join(left_out)}; comparison.md has them")
        return [*told, f"files: {self.folder}"]


def compare(combinations: Sequence[Combination], folder: Path, *, drawn: bool = True) -> Comparison:
    """Runs what can run, one after the other, and writes everything below ``folder``.

    Runs take turns and never run at once: their step times would disturb each other.
    """
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
        return ()  # the first run has told
    files: list[Path] = []
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        if row["ran"]:
            groups.setdefault(_course(folder / row["run"]), []).append(row)
    with progress("figures", float(len(groups))) as advance:
        for done, own in enumerate(groups.values()):
            advance(float(done))
            common, labels = comparison_table.labels(own)
            logs = {label: load_log(folder / row["run"]) for label, row in zip(labels, own, strict=True)}
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
        "comparison.md": comparison_table.markdown(rows, pictures),
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
