"""Tables of a result go between its markers, and nowhere unless asked."""

import argparse
import json
from pathlib import Path
from typing import Any

import pytest
from bench import docs
from bench.results import circumstances
from bench.tables import Table

from ftqp import FtqpError

TABLE = Table(title="Speed of things", headings=("", "us"), rows=[("thing", "1.5")])
TEXT = "above\n<!-- begin bench_batch -->\nold\n<!-- end bench_batch -->\nbelow\n"


def result() -> dict[str, Any]:
    """As a benchmark makes it."""
    return {
        **circumstances("bench_batch", [], {"runs": 1}),
        "limitations": ["It is a thing."],
    }


def chosen(**given: Any) -> argparse.Namespace:
    """The options of a benchmark."""
    return argparse.Namespace(**{"out": None, "update_docs": False, "json": True, **given})


def test_a_text_gets_the_table_and_where_it_comes_from(tmp_path: Path) -> None:
    text = tmp_path / "docs" / "speed.md"
    text.parent.mkdir()
    text.write_text(TEXT)
    made = result()
    docs.shown(made, tmp_path / "results" / "bench_batch.md", {text: [TABLE]})
    lines = text.read_text().splitlines()
    assert lines[0] == "above" and lines[-1] == "below" and "old" not in lines
    assert "### Speed of things" in lines and "| thing | 1.5 |" in lines
    assert f"From [bench_batch.md](../results/bench_batch.md), {made['date'][:10]}, " in text.read_text()
    assert f"Made by `{made['command']}`." in text.read_text()


def test_a_text_without_the_markers_is_told_of(tmp_path: Path) -> None:
    text = tmp_path / "speed.md"
    text.write_text("nothing")
    with pytest.raises(FtqpError, match="begin bench_batch"):
        docs.shown(result(), tmp_path / "bench_batch.md", {text: [TABLE]})
    assert text.read_text() == "nothing"


def test_nothing_is_written_unless_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = tmp_path / "speed.md"
    text.write_text(TEXT)
    monkeypatch.setattr(docs, "SPEED", text)
    monkeypatch.setattr(docs, "folder", lambda benchmark: tmp_path / "results")
    made = result()
    docs.told(made, "Things", [TABLE], chosen())
    assert json.loads(capsys.readouterr().out) == made
    assert [file.name for file in tmp_path.iterdir()] == ["speed.md"] and text.read_text() == TEXT
    docs.told(made, "Things", [TABLE], chosen(out=tmp_path / "mine"))
    assert json.loads((tmp_path / "mine" / "bench_batch.json").read_text()) == made
    assert text.read_text() == TEXT
    docs.told(made, "Things", [TABLE], chosen(update_docs=True))
    report = (tmp_path / "results" / "bench_batch.md").read_text()
    assert "| thing | 1.5 |" in report and "It is a thing." in report
    assert "| thing | 1.5 |" in text.read_text()
