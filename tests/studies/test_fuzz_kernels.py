"""Damaged machine code is left alone, and who judges it sees a process that uses it."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from fuzz import kernels

pytestmark = pytest.mark.skipif(
    shutil.which("cc") is None or os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"),
    reason="needs a C compiler (apt install gcc), and compiled code",
)


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    return kernels.prepared(tmp_path_factory.mktemp("good"))


@pytest.mark.parametrize("number", range(6))
def test_sample_of_damaged_files_is_left_alone(good, number: int, tmp_path: Path) -> None:
    found = kernels.trial(number, good, np.random.default_rng([14, number]), tmp_path)
    assert found.wrong == [] and found.refused, found.what


def test_trials_differ_and_can_be_made_again(good, tmp_path: Path) -> None:
    first, again, other = (
        kernels.trial(number, good, np.random.default_rng([14, number]), tmp_path / str(k))
        for k, number in enumerate((7, 7, 8))
    )
    assert first.what == again.what != other.what


@pytest.mark.parametrize("way", kernels.CONTENTS)
def test_each_way_changes_a_file(way) -> None:
    content = bytes(range(256)) * 64
    for seed in range(20):
        assert way(content, np.random.default_rng(seed)) != content


def judged(good, *, place=None, due=True, **changed):
    """What is wrong of a process that leaves a file alone and says so, but for what changed."""
    place = place or good.entries / "step-8.kernel"
    sentence = f"{place} is damaged, {kernels.REFUSAL}; it is compiled anew"
    said = {"digest": good.digest, "instead": ["step"], "library": False, "said": [sentence], **changed}
    if "ended" in changed:
        del said["digest"]
    found = kernels.Found(number=0, what="")
    kernels.judged(found, said, good, place, due=due)
    return "; ".join(found.wrong)


def test_judge_sees_a_file_that_is_used_other_commands_a_crash_and_silence(good) -> None:
    assert judged(good) == ""
    assert "the commands are others" in judged(good, digest="0")
    assert "the file is used" in judged(good, instead=[])
    assert "the file is used" in judged(good, place=good.ahead / kernels.LIBRARY, library=True)
    assert "no sentence names step-8.kernel" in judged(good, said=["all is well"])
    assert judged(good, said=[], due=False) == ""
    assert "the process ended in exit status -11" in judged(good, ended="exit status -11: ")


def test_judge_sees_a_process_that_takes_what_it_finds(good, tmp_path: Path, monkeypatch) -> None:
    """The same process, but without a look at the marks of a file: it takes one that is longer."""
    text = kernels.RIDE.read_text(encoding="utf-8")
    careless = tmp_path / "careless.py"
    careless.write_text(
        text.replace(
            "    digest = commands()\n",
            "    from ftqp.kernel.compiled import stored\n"
            "    kernel.unpacked = lambda content, wanted: stored._parted(content)[1]\n"
            "    digest = commands()\n",
        ),
        encoding="utf-8",
    )
    monkeypatch.setattr(kernels, "RIDE", careless)
    monkeypatch.setattr(kernels, "CONTENTS", (kernels.longer,))
    wrong = []
    for number in range(12):
        rng = np.random.default_rng([14, number])
        found = kernels.trial(number, good, rng, tmp_path / str(number))
        wrong += found.wrong if found.what.startswith("cache") and found.what.endswith("longer") else []
    assert "the file is used" in wrong
