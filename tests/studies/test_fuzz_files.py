"""Files drawn by their grammar are taken or refused in clear words; who judges that sees what is not."""

import json
import time
from pathlib import Path

import pytest
from fuzz.files import promises, trial
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.scripts import told

from ftqp.core.errors import FtqpError, InputError

FEW = settings(max_examples=12, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
QUICK = tuple(set(trial.KINDS) - {"study", "summary"})


@pytest.mark.parametrize("kind", sorted(QUICK))
@FEW
@given(rng=st.randoms(use_true_random=False))
def test_file_is_taken_or_refused_in_clear_words(kind: str, rng) -> None:
    assert trial.tried(kind, rng).wrong == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", trial.KINDS)
@settings(FEW, max_examples=400)
@given(rng=st.randoms(use_true_random=False))
def test_many_files_are_taken_or_refused_in_clear_words(kind: str, rng) -> None:
    assert trial.tried(kind, rng).wrong == []


def test_file_is_drawn_again_by_seed_and_number() -> None:
    first, again = (trial.numbered("overrides", 14, 3) for _ in range(2))
    assert first.sentence.partition("scenario.toml")[2] == again.sentence.partition("scenario.toml")[2]


def fails() -> None:
    raise KeyError("name")


def mutters() -> None:
    raise InputError("float() argument must be a string or a real number, not 'dict'")


def says_two() -> None:
    raise InputError("one thing\nand another")


def hangs() -> None:
    time.sleep(30.0)


@pytest.mark.parametrize(
    ("use", "said"),
    [
        (fails, "KeyError: 'name'"),
        (mutters, "'float()' is said"),
        (says_two, "2 lines are said, expected 1"),
        (hangs, "it was not done after 1 s"),
    ],
)
def test_judge_sees_what_is_no_clear_refusal(tmp_path: Path, monkeypatch, use, said: str) -> None:
    if use is hangs:
        monkeypatch.setattr(promises, "SECONDS", 1)
    assert said in promises.judged(use, tmp_path, files=()).wrong[0]


def test_judge_sees_a_file_that_is_altered_or_lost(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text("a = 1")
    assert promises.judged(lambda: None, tmp_path, files=(file,)).wrong == []
    assert "altered" in promises.judged(lambda: file.write_text("a = 2"), tmp_path, files=(file,)).wrong[0]
    assert "lost" in promises.judged(file.unlink, tmp_path, files=(file,)).wrong[0]


def test_judge_sees_control_characters_and_endless_lines() -> None:
    error = FtqpError("")
    error.args = ("\x1b[31m",)
    assert "control character" in promises.unclear(error)[0]
    error.args = ("a b " * 1000,)
    assert "a line of 4000 letters" in promises.unclear(error)[0]


@pytest.mark.slow
def test_script_counts_and_reports(tmp_path: Path) -> None:
    given = ("--files=3", "--kinds=table,profile", "--json", "--out", tmp_path)
    kinds = json.loads(told("studies/fuzz_files.py", *given))["kinds"]
    assert [total["files"] for total in kinds.values()] == [3, 3]
    assert "python studies/fuzz_files.py" in (tmp_path / "fuzz_files.md").read_text(encoding="utf-8")
