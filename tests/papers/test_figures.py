"""Numbers behind the figures that studies draw of the papers, and what the command says to bad input."""

import json

import pytest
from tests.scripts import ROOT, ran, told

PAPERS = ("bedrossian1993", "holt1994", "goel2005", "zhang2016", "jin2017")


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    """What every figure of a paper shows, by its name; the pictures are looked for."""
    found = {}

    def of(name):
        if name not in found:
            folder = tmp_path_factory.mktemp(name)
            found[name] = json.loads(told(f"studies/{name}.py", "--figures", folder))
            for sheet in found[name].values():
                assert sheet["table"] or (folder / sheet["file"]).stat().st_size > 5_000
        return {key: sheet["values"] for key, sheet in found[name].items()}

    return of


@pytest.mark.slow
def test_holts_inverses_have_the_wells_of_the_paper(figures):
    values = figures("holt1994")
    assert values["1"]["pseudoinverse"] == pytest.approx(9.98, abs=0.05)
    assert values["1"]["J‡"] == pytest.approx(20.6, abs=0.2)
    assert values["7"]["weak"] == pytest.approx(30.5, abs=0.3)
    assert values["table 1"]["ratios"][0] == 1.0 and min(values["table 1"]["ratios"][1:]) > 1.0


@pytest.mark.slow
def test_holts_steps_overshoot_as_a_servo_fitted_to_one_row_says(figures):
    values = figures("holt1994")
    assert values["table 2"]["overshoot"] == pytest.approx([0.959, 3.331, 0.0016, 2.034], abs=0.01)
    assert values["table 2"]["settled"] == pytest.approx([1.5, 0.9, 0.9, 0.9])
    assert values["table 3"]["overshoot"] == pytest.approx([4.35, 16.84, 12.61, 11.45], abs=0.02)
    assert values["table 3"]["settled"] == pytest.approx([3.2, 3.0, 2.3, 2.4])


@pytest.mark.slow
def test_servo_of_holts_steps_is_the_one_that_is_nearest_to_the_published_row(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "studies"))
    import holt1994

    assert holt1994.fit() == holt1994.SERVO


@pytest.mark.slow
def test_page_shows_every_figure(figures):
    page = (ROOT / "docs" / "evidence" / "paper-figures.md").read_text(encoding="utf-8")
    for name in PAPERS:
        for key in figures(name):
            part = page.partition(f"<!-- begin {name} {key} -->")[2].partition("<!-- end")[0]
            assert "**Ours**" in part and ("![" in part or "|---|" in part), (name, key)


@pytest.mark.parametrize(
    "name", [*(pytest.param(one, marks=pytest.mark.slow) for one in PAPERS[:-1]), PAPERS[-1]]
)
def test_unknown_figure_is_answered_with_those_that_there_are(name, tmp_path):
    done = ran(f"studies/{name}.py", "--figures", tmp_path, "--only", "99")
    assert done.returncode == 2
    assert f"--only 99: no such figure of {name}; it has " in done.stderr and "Traceback" not in done.stderr
