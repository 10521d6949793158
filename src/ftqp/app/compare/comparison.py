"""Runs scenarios under several schemes and backends and says side by side what came of each."""

import csv
import io
import json
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from ftqp.app.compare.combinations import Combination, file_name
from ftqp.app.output.console import ExitCode, Shown, Table, json_text, progress
from ftqp.app.output.words import KEPT
from ftqp.app.run import runs
from ftqp.core.errors import FtqpError, MissingPackage
from ftqp.sim.log.log_file import load_log

Row = Mapping[str, Any]
KINDS = ("scenario", "scheme", "backend")
BEST = "*"
NOTHING = "-"
LIMITS = "limits"
NOT_BEGUN = "interrupted before it began"
CUT_SHORT = "interrupted while its files were written"


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


def table_of(rows: Sequence[Row], why: Sequence[str]) -> Table:
    """A group's table, with those of scenario, scheme and backend that differ; ``why`` are all reasons."""
    kinds = [kind for kind in KINDS if len({row["label"][kind] for row in rows}) > 1] or ["backend"]
    lines = []
    for row in rows:
        note = f" ({why.index(row['reason']) + 1})" if row["reason"] else ""
        cells = [
            f"{form(row)}{BEST if mark and _is_best(row, rows, mark) else ''}" if row["ran"] else NOTHING
            for form, mark in COLUMNS.values()
        ]
        lines.append((*(str(row["label"][kind]) for kind in kinds), _result(row) + note, *cells))
    return Table(labels(rows)[0], (*kinds, "result", *COLUMNS), lines, set(COLUMNS) - {LIMITS})


def reasons(rows: Sequence[Row]) -> list[str]:
    """Why runs have no figures, or not all, each once."""
    return list(dict.fromkeys(row["reason"] for row in rows if row["reason"]))


def _result(row: Row) -> str:
    """How it ended."""
    if not row["ran"]:
        return "not run"
    if row["interrupted"]:
        return f"interrupted at {row['steps'] * row['dt']:.4g} s"
    if row["stopped_at"] is not None:
        return f"stopped at {row['stopped_at']:.4g} s"
    return "completed" if row["completed"] else "not completed"


def _is_best(row: Row, rows: Sequence[Row], value: Callable[[Row], float | None]) -> bool:
    """Whether it has the least value, to three digits, of its scenario's completed runs, which differ."""
    own = [
        f"{x:.3g}"
        for one in rows
        if one["completed"] and one["label"]["scenario"] == row["label"]["scenario"]
        and (x := value(one)) is not None
    ]  # fmt: skip
    mine = value(row) if row["completed"] else None
    return mine is not None and len(set(own)) > 1 and f"{mine:.3g}" == min(own, key=float)


def _exceeded(row: Row) -> str:
    """The limits that were exceeded, and by how much; ``kept`` when none was."""
    beyond = [f"{key} by {value:.2g}" for key, value in row["max_limit_violation"].items() if value > KEPT]
    return ", ".join(beyond) or "kept"


def _moved(row: Row) -> str:
    motion = row["max_failed_joint_motion"].values()
    return f"{max(motion):.3g}" if motion else NOTHING


def _counts(row: Row) -> str:
    return "/".join(str(row["status_counts"].get(name, 0)) for name in ("RELAXED", "SCALED", "FALLBACK"))


def _number(value: Callable[[Row], float | None], factor: float) -> "_Column":
    """A column of numbers, the least of which is marked."""

    def form(row: Row) -> str:
        x = value(row)
        return NOTHING if x is None else f"{factor * x:.3g}"

    return form, value


_Column = tuple[Callable[[Row], str], Callable[[Row], float | None] | None]
"""What stands in a cell of a run, and the number of which the least is the best, or None."""
COLUMNS: Final[dict[str, _Column]] = {
    "max error\n[mm]": _number(lambda row: row["max_position_error"], 1e3),
    LIMITS: (_exceeded, None),
    "failed joint\nmoved [rad]": (_moved, None),
    "relaxed/\nscaled/\nfallback": (_counts, None),
    "step p50\n[us]": _number(lambda row: row["step_time_us"]["p50"], 1.0),
}
"""The columns of a table, by their headings: a terminal has room for so many."""


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

    @property
    def exit_code(self) -> ExitCode:
        """What the process should return: interrupted, or stopped if any run was not completed, or done."""
        if self.interrupted:
            return ExitCode.INTERRUPTED
        completed = all(row["completed"] for row in self.rows if row["ran"])
        return ExitCode.DONE if completed and not self.failed else ExitCode.STOPPED

    def summary(self) -> Shown:
        """The tables, what their marks mean, and where the files are."""
        why = reasons(self.rows)
        shown: list[str | Table] = [table_of(group, why) for group in groups(self.rows)]
        shown += [f"({number}) {reason}" for number, reason in enumerate(why, start=1)]
        shown.append(f"{BEST} the best of the completed runs; comparison.csv has every number of each")
        return [*shown, f"files: {self.folder}"]


def compare(combinations: Sequence[Combination], folder: Path, *, drawn: bool = True) -> Comparison:
    """Runs what can run, one after the other, and writes everything below ``folder``."""
    runs.make_folder(folder)
    rows, interrupted, failed = _rows(combinations, folder, drawn)
    runs.write(folder / "comparison.json", json_text({"runs": rows}))
    runs.write(folder / "comparison.csv", _csv(rows))
    if drawn and not interrupted:
        try:
            _draw(folder, rows)
        except KeyboardInterrupt:
            interrupted = True
    return Comparison(folder=folder, rows=tuple(rows), interrupted=interrupted, failed=failed)


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
                doing, place = f"{done + 1} of {todo}: {combination.name}", folder / combination.name

                def notify(share: float, done: int = done) -> None:
                    advance(done + share)

                try:
                    run = runs.run(combination.setup, place, advance=notify, drawn=drawn)
                    facts, interrupted = run.summary, run.summary["interrupted"]
                except KeyboardInterrupt:
                    interrupted, reason = True, CUT_SHORT
                    kept = place / runs.SUMMARY
                    facts = json.loads(kept.read_text("utf-8")) if kept.is_file() else {}
                except FtqpError as error:
                    failed, reason = True, str(error)
                done += 1
            label = {key: getattr(combination, key) for key in KINDS}
            row = {"run": combination.name, "label": label, "ran": bool(facts), "reason": reason or None}
            rows.append({**row, **(facts or {**label, "completed": False, "steps": 0})})
    return rows, interrupted, failed


def _draw(folder: Path, rows: Sequence[Row]) -> None:
    """Pictures of the runs of each arm and path side by side; none without matplotlib."""
    try:
        from ftqp.viz.figures.compared_runs import save_comparison
    except MissingPackage:
        return  # the first run has said it
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
            save_comparison(logs, folder / "figures", name=file_name("+".join(scenarios)), title=title)


def _course(run: Path) -> str:
    """Arm, start and path of a run, by which scenarios are drawn in one figure."""
    scenario = tomllib.loads((run / runs.SCENARIO).read_text("utf-8"))
    return json_text({table: scenario.get(table) for table in ("robot", "start", "path")})


def _csv(rows: Sequence[Row]) -> str:
    """One line a run; the keys of the summary as columns, nested ones with a dot, SI units."""
    flat = [_flat(row) for row in rows]
    text = io.StringIO()
    writer = csv.DictWriter(text, dict.fromkeys(key for row in flat for key in row), lineterminator="\n")
    writer.writeheader()
    writer.writerows(flat)
    return text.getvalue()


def _flat(row: Row, prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in row.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{key}.")
        elif not isinstance(value, list):
            flat[f"{prefix}{key}"] = value
    return flat
