"""``ftqp coverage`` interrupted: what is done is kept, and going on ends the same."""

import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from tests.app.conftest import invoke as asked
from typer.testing import Result

from ftqp.app.commands import covering

LINE = "planar3-line"
COARSE = ("--waypoints", "30", "--spacing", "0.15", "--set", "planner.dt=0.02")
EVERY = ("--stride", "20")


def text(result: Result) -> str:
    return " ".join(result.output.split())


def rows(folder: Path) -> list[Any]:
    with closing(sqlite3.connect(folder / "results.sqlite")) as file, file:
        names = "item, failure, t, status, last_sample, position, rotation, margin, hurry"
        return file.execute(f"SELECT {names} FROM results ORDER BY item").fetchall()


def interrupting(owner: Any, name: str, after: int, monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Ctrl-C in the midst of the work, until what is returned is called."""
    own, calls = getattr(owner, name), []

    def once(*given: Any) -> Any:
        calls.append(given)
        if len(calls) > after:
            raise KeyboardInterrupt
        return own(*given)

    monkeypatch.setattr(owner, name, once)
    return lambda: monkeypatch.setattr(owner, name, own)


def test_interrupted_coverage_goes_on_to_the_same_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = asked("coverage", LINE, *EVERY, "--out", tmp_path / "whole", "--json")
    assert whole.exit_code == 0, whole.output
    out = tmp_path / "out"
    mend = interrupting(covering, "pair_rows", 2, monkeypatch)
    broken = asked("coverage", LINE, *EVERY, "--out", out)
    mend()
    assert broken.exit_code == 130 and f"--out {out} --resume goes on from there" in text(broken)
    assert 0 < len(rows(out)) < len(rows(tmp_path / "whole"))
    refused = asked("coverage", LINE, *EVERY, "--out", out)
    assert refused.exit_code == 2 and "go on by --resume" in text(refused)
    other = asked("coverage", LINE, "--stride", "10", "--out", out, "--resume")
    assert other.exit_code == 2
    assert "holds results of another study ('stride = 20' there, 'stride = 10' here)" in text(other)
    with monkeypatch.context() as newer:
        newer.setattr(covering, "__version__", "99.0")
        later = asked("coverage", LINE, *EVERY, "--out", out, "--resume")
    assert later.exit_code == 2 and "was made by ftqp" in text(later)
    done = asked("coverage", LINE, *EVERY, "--out", out, "--resume", "--json")
    assert done.exit_code == 0, done.output
    assert rows(out) == rows(tmp_path / "whole")
    facts = [json.loads(result.stdout) for result in (whole, done)]
    assert facts[0]["coverage"] == facts[1]["coverage"] and Path(facts[1]["page"]).exists()


def test_plan_that_cannot_be_made_leaves_nothing(tmp_path: Path) -> None:
    result = asked("plan", LINE, *COARSE, "--set", "path.duration=0.5", "-o", tmp_path / "plan.npz")
    assert result.exit_code == 2 and not list(tmp_path.iterdir())
