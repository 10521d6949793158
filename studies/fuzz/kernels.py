"""Files of compiled code that are damaged in every way, and what a process with them has to do."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, final

from ftqp.kernel.compiled import kernel
from ftqp.kernel.compiled.folder import VARIABLE
from ftqp.kernel.compiled.mode import KERNEL, source_key
from ftqp.kernel.compiled.wheel import LIBRARY, MANIFEST, fingerprint, platform_facts
from ftqp.kernel.entry.table import ENTRIES

RIDE = Path(__file__).with_name("kernel_ride.py")
TOO_LONG = 120.0
"""A process that takes longer hangs [s]."""
STRANGER = 54_321
"""A user who owns nothing here."""
REFUSAL = "so its machine code is not loaded"


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Good:
    """What is damaged in copies.

    Attributes:
        cache: The folder of the user's cache, with the files of the entry points that a ride needs.
        ahead: A wheel's folder with a library of the same code.
        files: Names of the files in the cache.
        digest: Of the commands that they compute.
    """

    cache: Path
    ahead: Path
    files: tuple[str, ...]
    digest: str

    @property
    def entries(self) -> Path:
        """The folder of the entry points."""
        return self.cache / f"kernel-{source_key(KERNEL)}"


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
    """Good copies of what a ride needs; what this machine has not compiled yet is compiled.

    Args:
        folder: Where they go.

    Raises:
        OSError: There is no C compiler, or no place for compiled code.
        RuntimeError: The ride cannot be made.
    """
    said = ridden(Path("nowhere"), None, os.environ.get(VARIABLE))
    if "digest" not in said or said["instead"]:
        from ftqp.control.first_use import warm_up

        warm_up(("step", "write_target", "inverse_dynamics"), 8)
        said = ridden(Path("nowhere"), None, os.environ.get(VARIABLE))
    if "digest" not in said:
        raise RuntimeError(f"no commands are computed with good files: {said}")
    kept, files = kernel._KERNEL.kept_in(), tuple(f"{name}.kernel" for name in said["ready"])
    if kept is None:
        raise OSError("there is no folder for compiled code")
    good = Good(cache=folder / "cache", ahead=folder / "ahead", files=files, digest=said["digest"])
    good.entries.mkdir(parents=True, mode=0o700)
    for name in files:
        shutil.copy(kept / name, good.entries / name)
    for place in (folder, good.cache, good.entries):
        place.chmod(0o700)
    _linked(good)
    said = ridden(good.entries, good.ahead, str(good.cache))
    if not said.get("library") or said["digest"] != good.digest:
        raise RuntimeError(f"a good library is not used, or computes something else: {said}")
    return good


def _linked(good: Good) -> None:
    """A wheel's library of the same object files."""
    good.ahead.mkdir(mode=0o755)
    objects, entries = [good.ahead.parent / "fits.c"], {}
    objects[0].write_text("int ftqp_fits(void) { return 1; }\n")
    for name in good.files:
        content = (good.entries / name).read_bytes()
        line, _, code = content.partition(b"\n")[2].partition(b"\n")
        facts, place = json.loads(line), good.ahead.parent / f"{name}.o"
        place.write_bytes(code)
        objects.append(place)
        entries[facts["symbol"]] = [ENTRIES[facts["entry"]].signature, ENTRIES[facts["entry"]].nogil]
    library = good.ahead / LIBRARY
    command = ["cc", "-shared", "-fPIC", "-O2", "-o", str(library), *map(str, objects), "-lm"]
    subprocess.run(command, check=True)
    manifest = {**platform_facts(), "source": source_key(KERNEL), "entries": entries,
                "sha256": fingerprint(library.read_bytes())}  # fmt: skip
    (good.ahead / MANIFEST).write_text(json.dumps(manifest, indent=1))


def ridden(good: Path, ahead: Path | None, cache: str | None) -> dict[str, Any]:
    """What a process says that rides with these folders; its exit status where it says nothing.

    Args:
        good: Entry points that stand for what would be compiled.
        ahead: The folder of a wheel's library; None is none.
        cache: The folder of the user's cache; None is the usual one.
    """
    environment = {**os.environ, **({} if cache is None else {VARIABLE: cache})}
    command = [
        sys.executable,
        "-X",
        "faulthandler",
        str(RIDE),
        str(good),
        *([] if ahead is None else [ahead]),
    ]
    try:
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, timeout=TOO_LONG, check=False
        )
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
OWNERSHIP = ("another owner", "writable by all", "writable folder", "a link", "a folder", "no file")


def _owned_wrongly(place: Path, way: str) -> bool:
    """Give a file another owner, permission or kind: whether a sentence is due."""
    if way == "another owner":
        os.chown(place, STRANGER, -1)
    elif way == "writable by all":
        place.chmod(0o666)
    elif way == "writable folder":
        place.parent.chmod(0o777)
    elif way == "a link":
        place.rename(place.with_suffix(".elsewhere"))
        place.symlink_to(place.with_suffix(".elsewhere"))
    else:
        place.unlink()
        if way == "a folder":
            place.mkdir()
    return way not in ("a folder", "no file", "writable folder")


def trial(number: int, good: Good, rng: Any, folder: Path) -> Found:
    """Damage a copy, and see what a process makes of it.

    Args:
        number: Of the trial.
        good: What is copied.
        rng: Draws the damage.
        folder: A new folder for the copy.
    """
    cache, ahead = folder / "cache", folder / "ahead"
    shutil.copytree(good.cache, cache)
    shutil.copytree(good.ahead, ahead)
    entries, of_wheel = cache / good.entries.name, bool(rng.random() < 0.5)
    if of_wheel:
        place = ahead / (LIBRARY if rng.random() < 0.7 else MANIFEST)
    else:
        place = entries / good.files[int(rng.integers(len(good.files)))]
    ways = [way for way in OWNERSHIP if way != "another owner" or os.getuid() == 0]
    dice, due = rng.random(), True
    if dice < 0.7:
        way = CONTENTS[int(rng.integers(len(CONTENTS)))]
        what, content = way.__name__, place.read_bytes()
        place.write_bytes(way(content, rng))
        due = place.name != MANIFEST  # a manifest may be one of another machine then
    elif dice < 0.8:
        what = "swapped"
        due = _swapped(place, of_wheel, entries, good, rng)
    else:
        what = ways[int(rng.integers(len(ways)))]
        due = _owned_wrongly(place, what)
        if of_wheel:
            due = what in ("another owner", "writable by all", "writable folder")
    said = ridden(good.entries, ahead if of_wheel else None, str(cache))
    found = Found(number=number, what=f"{'wheel' if of_wheel else 'cache'}: {place.name}: {what}")
    judged(found, said, good, place, due=due, harmless=of_wheel and what == "a link")
    return found


def _swapped(place: Path, of_wheel: bool, entries: Path, good: Good, rng: Any) -> bool:
    """Another good file in its place: whether a sentence is due."""
    if of_wheel:
        text = json.loads((place.parent / MANIFEST).read_text())
        text["sha256"] = fingerprint(rng.bytes(8))
        (place.parent / MANIFEST).write_text(json.dumps(text))
        return True
    other = next(name for name in good.files if name != place.name)
    shutil.copy(entries / other, place)
    return False  # it is whole, and of another entry point


def judged(
    found: Found, said: dict[str, Any], good: Good, place: Path, *, due: bool, harmless: bool = False
) -> None:
    """Hold what a process said against what is promised.

    Args:
        found: Gets what was wrong.
        said: What the process said.
        good: What it should have computed.
        place: What was damaged.
        due: Whether a sentence has to name it.
        harmless: Whether it may be used as it is.
    """
    if "digest" not in said:
        found.wrong.append(f"the process ended in {said['ended']}")
        return
    if said["digest"] != good.digest:
        found.wrong.append("the commands are others")
    of_wheel = place.parent.name == "ahead"
    used = said["library"] if of_wheel else place.name.rpartition("-")[0] not in said["instead"]
    found.refused = not used
    found.sentence = next((sentence for sentence in said["said"] if REFUSAL in sentence), "")
    if used and not harmless and (due or place.name != MANIFEST):
        found.wrong.append("the file is used")
    if due and str(place.parent) not in found.sentence:
        found.wrong.append(f"no sentence names {place.name}: {said['said']}")
