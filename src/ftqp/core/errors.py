"""The exceptions of ftqp: one root, and a class more only where a caller would act differently.

FtqpError
 +-- InputError        a value handed to ftqp is wrong (also a ValueError)
 +-- ModelError        a robot model is unsafe; carries every finding of the audit
 +-- ScenarioError     a scenario file is wrong; carries every error at once
 +-- MissingPackage    an optional package is not installed (also an ImportError)
"""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches


class FtqpError(Exception):
    """Root of every exception that ftqp raises on purpose."""


class InputError(FtqpError, ValueError):
    """A value handed to ftqp is wrong; the sentence says what, what was got, what is expected, the remedy."""


class ModelError(FtqpError):
    """A robot model cannot be used safely.

    Attributes:
        findings: Every finding of the audit, one sentence each.
    """

    def __init__(self, what: str, findings: Sequence[str] = ()) -> None:
        self.findings = tuple(findings)
        super().__init__("\n".join([what, *(f"  - {finding}" for finding in self.findings)]))


class ScenarioError(FtqpError):
    """A scenario cannot be run.

    Attributes:
        errors: Every error found, each with its path in the file.
    """

    def __init__(self, what: str, errors: Sequence[str] = ()) -> None:
        self.errors = tuple(errors)
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


def nearest(got: str, valid: Iterable[str]) -> str:
    """`` (did you mean 'x'?)`` for the valid name closest to ``got``, or nothing when none is close."""
    close = get_close_matches(got, list(valid), n=1, cutoff=0.5)
    return f" (did you mean {close[0]!r}?)" if close else ""


def unknown(kind: str, got: object, owner: str, valid: Iterable[str]) -> InputError:
    """The error for an unknown name: names the valid ones and the nearest.

    Args:
        kind: What the name should be, for example ``joint``.
        got: The name that was handed in.
        owner: Whose names these are, for example ``panda``.
        valid: The valid names.
    """
    names = list(valid)
    return InputError(
        f"{got!r} is not a {kind} of {owner}{nearest(str(got), names)}; it has {', '.join(names)}"
    )
