"""What holds of every file: it is taken, or refused in clear words; nothing hangs or is touched."""

import hashlib
import os
import re
import resource
import signal
import traceback
import unicodedata
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, final

from ftqp.core.errors import FtqpError, ModelError, ScenarioError

LONGEST = 1500
"""Letters that a line of a message has at most."""
SECONDS = 60
"""A file that takes longer hangs."""
COMPILING = 280
"""But one for which parts of the kernel have to be compiled may take so long."""
MEMORY = 6 * 2**30
"""Bytes that a process may take."""
FOREIGN = re.compile(
    r"Traceback|pydantic|[Vv]alidation ?[Ee]rror|Input should|has no attribute|NoneType|unhashable|<class|"
    r"not supported between|\bfloat\(\)|\bint\(\)|could not convert|invalid literal|<built|\[?Errno|unpack|"
    r"must be real|index out of|broadcast|ufunc|astype|dtype|object is not|array\(|KeyError|keyword arg"
)
"""Words of other programs that help nobody who wrote a file."""


@final
@dataclass(slots=True)
class Outcome:
    """What came of a file.

    Attributes:
        taken: Whether it was accepted.
        sentence: What was said where it was refused.
        wrong: What was promised and not kept, a sentence each.
    """

    taken: bool = False
    sentence: str = ""
    wrong: list[str] = field(default_factory=list)


class _Hangs(BaseException):
    """The time is over: in which line of ftqp, and whether that compiles its kernel."""

    def __init__(self, place: str, compiles: bool) -> None:
        super().__init__(place)
        self.place, self.compiles = place, compiles


def judged(
    use: Callable[[], object], folder: Path, *, files: tuple[Path, ...], seconds: int | None = None
) -> Outcome:
    """Use a file, and hold what happens against the promises.

    Args:
        use: Reads it, and does with it what a user would.
        folder: Where it lies; nothing is to appear or to vanish there.
        files: Those that are to stay as they are, byte for byte.
        seconds: How long it may take; without it ``SECONDS``, and longer where the kernel is compiled.
    """
    found = Outcome()
    before = _state(folder, files)
    try:
        with _limited(seconds), warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            warnings.simplefilter("ignore", ResourceWarning)
            use()
        found.taken = True
    except FtqpError as error:
        found.sentence = str(error)
        found.wrong += unclear(error)
    except _Hangs as late:
        if late.compiles and seconds is None:  # which is no matter of the file
            return judged(use, folder, files=files, seconds=COMPILING)
        found.wrong.append(f"it was not done after {seconds or SECONDS} s, in {late.place}")
    except (Exception, SystemExit) as error:
        place = traceback.extract_tb(error.__traceback__)
        own = [f for f in place if "ftqp" in f.filename]
        at = (own or place)[-1]
        found.wrong.append(
            f"{type(error).__name__}: {error!s:.160} ({Path(at.filename).name}:{at.lineno} {at.name})"
        )
    after = _state(folder, files)
    if after != before:
        changed = {key for key in before.keys() | after.keys() if before.get(key) != after.get(key)}
        found.wrong.append(f"files were lost, made or altered: {', '.join(sorted(changed))!s:.200}")
    return found


def unclear(error: FtqpError) -> list[str]:
    """What is wrong with the words of an error."""
    text, wrong = str(error), []
    lines = text.split("\n")
    told = getattr(error, "errors" if isinstance(error, ScenarioError) else "findings", ())
    known = 1 + len(told) if isinstance(error, ScenarioError | ModelError) else 1
    if not text.strip():
        wrong.append("nothing is said")
    if len(lines) != known:
        wrong.append(f"{len(lines)} lines are said, expected {known}: {text!r:.200}")
    if any(len(line) > LONGEST for line in lines):
        wrong.append(f"a line of {max(map(len, lines))} letters is said: {text!r:.200}")
    if match := FOREIGN.search(text):
        wrong.append(f"{match[0]!r} is said: {text[max(0, match.start() - 100) : match.end() + 60]!r}")
    if strange := [c for c in text if unicodedata.category(c) in ("Cc", "Cf", "Cs") and c != "\n"]:
        wrong.append(f"control character {strange[0]!r} is said: {text!r:.160}")
    return wrong


@contextmanager
def _limited(seconds: int | None) -> Iterator[None]:
    """Ends what takes too long; in the script a watch outside ends what never comes back to Python."""

    def late(number: int, frame: Any) -> None:
        stack = traceback.extract_stack(frame)
        own = [line for line in stack if "ftqp" in line.filename]
        place = f"{Path(own[-1].filename).name}:{own[-1].lineno}" if own else "?"
        raise _Hangs(place, any("/numba/" in line.filename for line in stack))

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds or SECONDS)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def limit_memory() -> None:
    """Let this process have no more than ``MEMORY``: what wants more is told so, not killed with others."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))


def _state(folder: Path, files: tuple[Path, ...]) -> dict[str, str]:
    """Names of all files, and what some of them hold."""
    found = {entry.path: "" for entry in os.scandir(folder)}
    for file in files:
        if file.is_file():
            found[str(file)] = hashlib.sha256(file.read_bytes()).hexdigest()
    return found
