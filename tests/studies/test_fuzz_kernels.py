"""Damaged machine code is left alone, and who judges it sees a process that uses it."""

from pathlib import Path

import numpy as np
import pytest
from fuzz import kernels

from ftqp.kernel.compiled.kernel import level

pytestmark = pytest.mark.skipif(not level(), reason="no built kernel is in use")


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    return kernels.prepared(tmp_path_factory.mktemp("good"))


def tried(good, number: int, folder: Path):
    return kernels.trial(number, good, np.random.default_rng([14, number]), folder)


@pytest.fixture(scope="module")
def samples(good, tmp_path_factory):
    return [tried(good, number, tmp_path_factory.mktemp("sample")) for number in range(3)]


def test_samples_of_damaged_files_are_left_alone(samples) -> None:
    assert not [(found.what, found.wrong) for found in samples if found.wrong]


def test_trials_differ_and_can_be_made_again(good, samples, tmp_path: Path) -> None:
    assert tried(good, 1, tmp_path).what == samples[1].what != samples[2].what


@pytest.mark.parametrize("way", kernels.CONTENTS)
def test_each_way_changes_a_file(way) -> None:
    content = bytes(range(256)) * 64
    for seed in range(20):
        assert way(content, np.random.default_rng(seed)) != content


def judged(good, *, harmless=False, **changed):
    """What is wrong of a process that leaves a library alone and says so, but for what changed."""
    sentence = f"its sha256 differs; {kernels.REFUSAL}"
    said = {"commands": good.commands, "library": False, "said": [sentence], **changed}
    if "ended" in changed:
        del said["commands"]
    found = kernels.Found(number=0, what="")
    kernels.judged(found, said, good, harmless=harmless)
    return "; ".join(found.wrong)


def test_judge_sees_a_library_that_is_used_other_commands_a_crash_and_silence(good) -> None:
    assert judged(good) == ""
    assert "the commands are others" in judged(good, commands=[x + 1e-8 for x in good.commands])
    assert "the library is used" in judged(good, library=True)
    assert judged(good, library=True, harmless=True) == ""
    assert "no sentence says" in judged(good, said=["all is well"])
    assert "the process ended in exit status -11" in judged(good, ended="exit status -11: ")


def test_judge_sees_a_process_that_takes_what_it_finds(good, tmp_path: Path, monkeypatch) -> None:
    """The same process, but without a look at the hash: it takes a library that is longer."""
    text = kernels.RIDE.read_text(encoding="utf-8")
    careless = tmp_path / "careless.py"
    careless.write_text(
        text.replace(
            "    found = commands()\n",
            "    from ftqp.kernel.compiled import library\n"
            "    library.fingerprint = lambda content: json.loads(\n"
            "        (Path(sys.argv[1]) / library.MANIFEST).read_text())['libraries'][0]['sha256']\n"
            "    found = commands()\n",
        ),
        encoding="utf-8",
    )
    monkeypatch.setattr(kernels, "RIDE", careless)
    monkeypatch.setattr(kernels, "CONTENTS", (kernels.longer,))
    for number in range(8):
        found = tried(good, number, tmp_path / str(number))
        if found.what == "library: longer" and "the library is used" in found.wrong:
            return
    pytest.fail("nobody saw it")
