"""Libraries of machine code that are damaged in every way, and what a process with them has to do."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, final

from ftqp.kernel.compiled.kernel import BUILT, level
from ftqp.kernel.compiled.library import MANIFEST, fingerprint

RIDE = Path(__file__).with_name("kernel_ride.py")
TOO_LONG = 120.0
"""A process that takes longer hangs [s]."""
REFUSAL = "plain Python does its work"


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Good:
    """What is damaged in copies.

    Attributes:
        built: A folder with the built library and its manifest.
        file: The name of the library.
        commands: What a ride with it computes.
    """

    built: Path
    file: str
    commands: list[float]


@final
@dataclass(slots=True, kw_only=True)
class Found:
    """What came of one trial.

    Attributes:
        number: Its number.
        what: What was damaged, and how.
        refused: Whether the damaged file was left alone.
        sentence: What was said of it; empty where nothing was.
        wrong: What was not as promised.
    """

    number: int
    what: str
    refused: bool = False
    sentence: str = ""
    wrong: list[str] = field(default_factory=list)


def prepared(folder: Path) -> Good:
    """A good copy of the built library."""
    if not level():
        raise RuntimeError("no built kernel is in use; `make kernel` builds it")
    shutil.copytree(BUILT, folder / "built")
    folder.chmod(0o700)
    manifest = json.loads((folder / "built" / MANIFEST).read_text())
    said = ridden(folder / "built")
    if not said.get("library"):
        raise RuntimeError(f"a good library is not used: {said}")
    return Good(built=folder / "built", file=manifest["libraries"][0]["file"], commands=said["commands"])


def ridden(built: Path) -> dict[str, Any]:
    """What a process says that rides with the library of a folder; how it ended where it says nothing."""
    command = [sys.executable, "-X", "faulthandler", str(RIDE), str(built)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TOO_LONG, check=False)
    except subprocess.TimeoutExpired:
        return {"ended": "a hang"}
    if done.returncode != 0:
        return {"ended": f"exit status {done.returncode}: {done.stderr.strip()[-300:]}"}
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return result


def truncated(content: bytes, rng: Any) -> bytes:
    """The first part of it: of any length, of the header alone, or all but some bytes."""
    size = len(content)
    ends = (int(rng.integers(size)), int(10.0 ** rng.uniform(0.0, 3.0)), size - 1 - int(rng.integers(64)), 0)
    return content[: ends[int(rng.integers(4))]]


def flipped(content: bytes, rng: Any) -> bytes:
    """One to four of its bits are others."""
    changed = bytearray(content)
    for at in rng.integers(len(content), size=1 + int(rng.integers(4))).tolist():
        changed[at] ^= 1 << int(rng.integers(8))
    return bytes(changed) if bytes(changed) != content else flipped(content, rng)


def blanked(content: bytes, rng: Any) -> bytes:
    """A page of it holds other bytes, as a disk leaves it that has lost its power."""
    at = int(rng.integers(max(1, len(content) - 4096)))
    other = bytes(4096) if rng.random() < 0.5 else rng.bytes(4096)
    return (content[:at] + other + content[at + 4096 :])[: len(content)]


def longer(content: bytes, rng: Any) -> bytes:
    """Something follows it."""
    return content + rng.bytes(1 + int(rng.integers(100)))


CONTENTS: tuple[Callable[[bytes, Any], bytes], ...] = (
    truncated,
    truncated,
    flipped,
    flipped,
    blanked,
    longer,
)
KINDS = ("a link", "a folder", "no file")


def _of_another_kind(place: Path, way: str) -> None:
    """Put something else in the place of a file."""
    if way == "a link":
        place.rename(place.with_suffix(".elsewhere"))
        place.symlink_to(place.with_suffix(".elsewhere"))
    else:
        place.unlink()
        if way == "a folder":
            place.mkdir()


def trial(number: int, good: Good, rng: Any, folder: Path) -> Found:
    """Damage a copy, and see what a process makes of it."""
    built = folder / "built"
    shutil.copytree(good.built, built)
    place = built / (good.file if rng.random() < 0.7 else MANIFEST)
    dice = rng.random()
    if dice < 0.7:
        way = CONTENTS[int(rng.integers(len(CONTENTS)))]
        what, content = way.__name__, place.read_bytes()
        place.write_bytes(way(content, rng))
    elif dice < 0.8:
        what = "swapped"
        text = json.loads((built / MANIFEST).read_text())
        text["libraries"][0]["sha256"] = fingerprint(rng.bytes(8))
        (built / MANIFEST).write_text(json.dumps(text))
    else:
        what = KINDS[int(rng.integers(len(KINDS)))]
        _of_another_kind(place, what)
    found = Found(number=number, what=f"{'manifest' if place.name == MANIFEST else 'library'}: {what}")
    harmless = what == "a link" or (place.name == MANIFEST and not _tells_of_the_library(place, good))
    judged(found, ridden(built), good, harmless=harmless)
    return found


def _tells_of_the_library(manifest: Path, good: Good) -> bool:
    """Whether a damaged manifest says something else of the library, or nothing at all."""
    try:
        said = json.loads(manifest.read_text())
        return bool(said["libraries"] != json.loads((good.built / MANIFEST).read_text())["libraries"])
    except (OSError, ValueError, KeyError, TypeError):
        return True


def judged(found: Found, said: dict[str, Any], good: Good, *, harmless: bool = False) -> None:
    """Hold what a process said against what is promised."""
    if "commands" not in said:
        found.wrong.append(f"the process ended in {said['ended']}")
        return
    worst = max(abs(one - other) for one, other in zip(said["commands"], good.commands, strict=True))
    if not worst <= (0.0 if said["library"] else 1e-9):
        found.wrong.append("the commands are others")
    found.refused = not said["library"]
    found.sentence = next((sentence for sentence in said["said"] if REFUSAL in sentence), "")
    if not found.refused and not harmless:
        found.wrong.append("the library is used")
    if found.refused and not found.sentence:
        found.wrong.append("no sentence says that it is not used")
