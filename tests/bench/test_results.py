"""What is on record: one report a study under a name that stays, and the same tables in the README."""

import json
import re
from pathlib import Path

import pytest
from bench.results import FOLDERS, README, ROOT, folder, stem, written

REPORTS = sorted(report for home in FOLDERS for report in (home / "results").glob("*.md"))


SHOWN = {
    README: ("compare_accuracy", "compare_speed", "study_dtrnn"),
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


def test_every_study_has_one_report_without_a_date_that_shows_its_pictures() -> None:
    assert len(REPORTS) > 20
    for file in (picture for home in FOLDERS for picture in (home / "results").glob("*.png")):
        reports = [report for report in REPORTS if report.parent == file.parent]
        assert any(file.name in report.read_text(encoding="utf-8") for report in reports), file
    for report in REPORTS:
        assert not re.search(r"\d{4}-\d\d-\d\d", report.name)
        text = report.read_text(encoding="utf-8")
        for picture in re.findall(r"!\[[^]]*\]\(([^)]+)\)", text):
            assert (report.parent / picture).exists(), picture
        for word in (f"python {report.parents[1].name}/", "numpy ", "numba "):
            assert word in text, f"{report.name} does not say {word}"


def test_a_full_result_replaces_the_last_and_a_quick_one_does_not(tmp_path: Path) -> None:
    assert stem("study", name=None, quick=False) == "study"
    assert stem("study", name=None, quick=True) == "study-quick"
    assert stem("study", name="mine", quick=True) == "study-mine"

    def drawn(result: dict[str, int], folder: Path, name: str) -> list[Path]:
        file = folder / f"{name}-two-curves.png"
        file.write_bytes(b"")
        return [file]

    for value in (1, 2):
        written({"value": value}, "# Study\n", tmp_path, "study", drawn)
    assert json.loads((tmp_path / "study.json").read_text())["value"] == 2
    text = (tmp_path / "study.md").read_text()
    assert text.startswith("# Study\n\n## Figures\n\n![two curves](study-two-curves.png)\n\nMade at")
    assert len(list(tmp_path.iterdir())) == 3
