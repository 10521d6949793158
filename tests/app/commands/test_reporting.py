"""``ftqp report``: one page that opens offline, escapes what files say, and refuses bad input in words."""

import json
import re
from functools import partial
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from tests.app.conftest import invoke

import ftqp
from ftqp.app.commands import reporting
from ftqp.control.planner.planner import Planner
from ftqp.model import catalog
from ftqp.sim.loop import Simulation
from ftqp.sim.schedule import FaultEvent, Schedule

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')

OUTSIDE = re.compile(r"^\s*(?:[a-z]+:)?//|^\s*(?:https?|ftp|file):", re.IGNORECASE)


class Reader(HTMLParser):
    """Tags, texts and addresses of a page; pages within it are read, too."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.source = text
        self.tags: list[str] = []
        self.texts: list[str] = []
        self.addresses: list[str] = []
        self.inner: list[Reader] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            if name in ("src", "href", "srcset", "action", "data", "poster"):
                self.addresses.append(value or "")
            self.addresses += re.findall(r"url\(['\"]?([^)'\"]*)", value or "") if name == "style" else []
            if name == "srcdoc":
                self.inner.append(Reader(value))

    def handle_data(self, data: str) -> None:
        self.texts.append(data)
        if self.tags and self.tags[-1] == "style":
            self.addresses += re.findall(r"url\(['\"]?([^)'\"]*)", data)

    @property
    def everywhere(self) -> list[str]:
        """All addresses, those of inner pages too."""
        return [*self.addresses, *(address for page in self.inner for address in page.everywhere)]


asked = partial(invoke, "report")


@pytest.fixture(scope="module")
def run_of(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Makes the folder of a short run, with other settings."""

    def made(name: str, *overrides: str) -> Path:
        out = tmp_path_factory.mktemp("runs") / name
        wanted = ["run", "--no-figures", "planar6-square", "--out", out, "--set", "simulation.duration=1.0"]
        wanted += ["--set", "faults.0.at=0.5", *(part for one in overrides for part in ("--set", one))]
        result = invoke(*wanted)
        assert result.exit_code == 0, result.output
        return out

    return made


@pytest.fixture(scope="module")
def told(run_of: Any) -> Path:
    folder: Path = run_of("told")
    return folder


@pytest.fixture
def still(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports without replays, which take a second each."""
    monkeypatch.setattr(reporting, "_replay", lambda *_, **__: ("no replay here", False))


def test_report_has_words_numbers_figures_replay_and_scenario(told: Path, tmp_path: Path) -> None:
    pytest.importorskip("viser", reason='needs the extra "viz": pip install -e ".[viz]"')
    file = tmp_path / "new" / "page.html"
    result = asked(told, "-o", file, "--json")
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout)
    assert facts["report"] == str(file) and facts["notes"] == []
    assert facts["bytes"] == file.stat().st_size < reporting.LARGEST
    page = Reader(file.read_text(encoding="utf-8"))
    words = "".join(page.texts)
    for expected in ("j1 locks at 0.5 s", "Every joint limit was kept", "Numbers", "kind = \"square\"",
                     "Versions", "The arm at a few instants",
                     "largest distance from the target"):  # fmt: skip
        assert expected in words
    assert page.tags.count("svg") == 5, "path, joints, velocities, torques, status"
    from tests.viz.live.tape import messages_of

    (played,) = page.inner
    duration, messages = messages_of(played.source)
    assert duration == pytest.approx(1.0, abs=0.05) and len(messages) > 100
    assert [address for address in page.everywhere if OUTSIDE.match(address)] == []


def test_several_runs_stand_side_by_side(told: Path, run_of: Any, tmp_path: Path, still: None) -> None:
    other = run_of("other", "faults.0.announced=never")
    assert asked(told, other, "-o", tmp_path / "page.html").exit_code == 0
    page = Reader((tmp_path / "page.html").read_text(encoding="utf-8"))
    words = "".join(page.texts)
    assert "How far the end effector of each run was from its target" in words
    for expected in ("told", "other", "nobody reports it", "no replay here"):
        assert expected in words
    assert page.tags.count("svg") == 2 + 5 + 5


def test_what_files_say_stays_text(tmp_path: Path, still: None) -> None:
    evil = "<script>alert(1)</script>"
    robot = catalog.load("planar6")
    path = ftqp.paths.Line(robot.pose(robot.neutral), (0.01, 0.0, 0.0), duration=0.2)
    schedule = Schedule([FaultEvent(0.1, ftqp.Locked("j2"))])
    file = tmp_path / "log.npy"
    about = {"scenario": evil, "scheme": "<i>s</i>", "resolved": f"description = '''{evil}'''"}
    Simulation(
        Planner(robot, dt=0.01), path, q=robot.neutral, schedule=schedule, log=file, metadata=about
    ).run()
    said = file.with_suffix(".json")  # a joint of another name
    said.write_text(said.read_text().replace("j2", json.dumps(evil)[1:-1]))
    assert asked(tmp_path, "-o", tmp_path / "page.html").exit_code == 0
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    page = Reader(text)
    assert "script" not in page.tags and "i" not in page.tags
    assert f"{evil} locks at 0.1 s" in "".join(page.texts)
    assert text.count("&lt;script&gt;") > 5


@pytest.mark.parametrize(
    ("source", "said"),
    [("none", "does not exist"), ("empty", "holds no result"), ("file.txt", "is not a log of ftqp"),
     ("broken", "is not a summary of ftqp, or is damaged")],
)  # fmt: skip
def test_what_is_no_run_is_refused_in_one_sentence(source: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "file.txt").write_text("hello", encoding="utf-8")
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "summary.json").write_text("{", encoding="utf-8")
    result = asked(tmp_path / source, "-o", tmp_path / "page.html")
    assert result.exit_code == 2
    assert said in result.output
    assert len(result.output.strip().splitlines()) == 1
    assert not (tmp_path / "page.html").exists()


def test_report_that_exists_is_not_overwritten(told: Path, tmp_path: Path) -> None:
    (tmp_path / "page.html").write_text("mine", encoding="utf-8")
    result = asked(told, "-o", tmp_path / "page.html", "--json")
    assert result.exit_code == 2
    assert "nothing is overwritten" in json.loads(result.stdout)["error"]
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == "mine"


def test_coverage_results_are_a_section(tmp_path: Path) -> None:
    out = tmp_path / "cover"
    made = invoke("coverage", "planar3-line", "--out", out, "--stride", "40")
    assert made.exit_code == 0, made.output
    assert asked(out, "-o", tmp_path / "page.html").exit_code == 0
    page = Reader((tmp_path / "page.html").read_text(encoding="utf-8"))
    words = "".join(page.texts)
    assert "which failures are survived" in words and "Joint by joint" in words
    assert page.tags.count("img") == 2
    assert all(address.startswith("data:image/png") for address in page.addresses)
    facts = json.loads((out / "summary.json").read_text())
    (out / "summary.json").write_text(json.dumps(facts | {"coverage": "many"}))
    bad = asked(out, "-o", tmp_path / "second.html")
    assert bad.exit_code == 2 and "not as `ftqp coverage` writes it" in bad.output
