"""What is on record: one report a study under a name that stays, and the same tables in the README."""

import re
from pathlib import Path

import pytest
from bench.results import README, ROOT, folder

SHOWN = {
    README: ("compare_accuracy",),
    ROOT / "docs/evidence/speed.md": ("bench_step", "bench_memory", "bench_first_use", "bench_batch"),
}


@pytest.mark.parametrize(("text", "name"), [(text, name) for text, names in SHOWN.items() for name in names])
def test_a_text_shows_the_tables_of_the_report_on_record(text: Path, name: str) -> None:
    """Every line of its part of the text is one of the report; so are date and command."""
    report = (folder(name) / f"{name}.md").read_text(encoding="utf-8")
    part = (
        text.read_text(encoding="utf-8").split(f"<!-- begin {name} -->")[1].split(f"<!-- end {name} -->")[0]
    )
    *lines, last = [line.lstrip("# ") for line in part.splitlines() if line]
    held = {line.lstrip("# ") for line in report.splitlines()}
    assert len(lines) > 4 and not [line for line in lines if line not in held]
    said = re.fullmatch(r"From \[(\S+)\]\((\S+)\), (\S+), .* Made by `(.*)`\.", last)
    assert said is not None and said[1] == f"{name}.md"
    assert (text.parent / said[2]).resolve() == folder(name) / f"{name}.md"
    assert said[3] in report and f"    {said[4]}" in report.splitlines()
