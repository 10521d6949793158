"""The exceptions of ftqp: one root, and a class more only where a caller would act differently.

FtqpError
 +-- InputError        a value handed to ftqp is wrong (also a ValueError)
 +-- ModelError        a robot model is unsafe; carries every finding of the audit
 +-- ScenarioError     a scenario file is wrong; carries every error at once
 +-- MissingPackage    an optional package is not installed (also an ImportError)
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from typing import Final
from unicodedata import category

HIDDEN: Final = ("Cc", "Cf", "Cs")
"""Categories of characters that are not seen, and that may move the cursor or turn the text of a terminal."""


def printable(text: str, keep: str = "\n") -> str:
    """A text in which characters that are not seen are written as escapes, for example ``\x1b``.

    Words from files of others get into messages, and terminals obey such characters.
    """
    if text.isprintable():
        return text
    return "".join(
        letter.encode("unicode_escape").decode()
        if letter not in keep and category(letter) in HIDDEN
        else letter
        for letter in text
    )


class FtqpError(Exception):
    """Root of every exception that ftqp raises on purpose.

    Args:
        text: One sentence: what, got, expected, remedy.
    """

    def __init__(self, text: str) -> None:
        super().__init__(printable(text))


class InputError(FtqpError, ValueError):
    """A value handed to ftqp is wrong; the sentence says what, what was got, what is expected, the remedy."""


@contextmanager
def reading(file: object, what: str, remedy: str) -> Iterator[None]:
    """While a file is read that a program writes: all that goes wrong is one sentence."""
    try:
        yield
    except FtqpError:
        raise
    except FileNotFoundError as error:
        raise InputError(f"{file} does not exist, expected {what}; {remedy}") from error
    except Exception as error:  # JSON, zip, numpy and SQLite have many for bytes that nobody has written
        why = f"{type(error).__name__}: {error!s:.100}"
        raise InputError(f"{file} is not {what}, or is damaged ({why}); {remedy}") from error


class ModelError(FtqpError):
    """A robot model cannot be used safely.

    Attributes:
        findings: Every finding of the audit, one sentence each.
    """

    def __init__(self, what: str, findings: Sequence[str] = ()) -> None:
        self.findings = tuple(printable(finding, keep="") for finding in findings)
        super().__init__("\n".join([what, *(f"  - {finding}" for finding in self.findings)]))


class ScenarioError(FtqpError):
    """A scenario cannot be run.

    Attributes:
        errors: Every error found, each with its path in the file.
    """

    def __init__(self, what: str, errors: Sequence[str] = ()) -> None:
        self.errors = tuple(printable(error, keep="") for error in errors)
        super().__init__("\n".join([what, *(f"  - {error}" for error in self.errors)]))


class MissingPackage(FtqpError, ImportError):
    """An optional package is not installed.

    Attributes:
        package: The package that is missing.
        remedy: The command that installs it.
    """

    def __init__(self, what: str, package: str, remedy: str) -> None:
        self.package = package
        self.remedy = remedy
        super().__init__(f"{what} needs the package {package!r}, which is not installed; {remedy}")


SAME_THING = {"solver": "backend", "objective": "scheme", "obstacles": "scene", "rate": "dt", "ee": "tip"}
"""What others call our options: word to name."""


def nearest(got: str, valid: Iterable[str]) -> str:
    """`` (did you mean 'x'?)`` for the valid name closest to ``got``, or nothing when none is close."""
    names = list(valid)
    same = SAME_THING.get(got)
    close = [same] if same in names else get_close_matches(got, names, n=1, cutoff=0.5)
    return f" (did you mean {close[0]!r}?)" if close else ""


def unknown(kind: str, got: object, owner: str, valid: Iterable[str], remedy: str = "") -> InputError:
    """The error for an unknown name: names the valid ones and the nearest."""
    names = list(valid)
    return InputError(
        f"{got!r:.80} is not a {kind} of {owner}{nearest(str(got), names)}; it has {', '.join(names)}"
        f"{remedy and '; '}{remedy}"
    )
