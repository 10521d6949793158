"""Who takes part in a comparison: backends by name, or with the settings of a profile."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ftqp import FtqpError
from ftqp.core.errors import InputError, MissingPackage, unknown
from ftqp.qp import Backend, backend, backend_names
from ftqp.qp.adapters.registry import profile

PROFILES = Path(__file__).resolve().parents[1] / "solvers" / "profiles"
REFERENCE = "active_set"
"""The contender that times are compared with."""
PAPER = "-paper-"
"""In the names of profiles that repeat a publication: thousands of iterations."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Contender:
    """A backend with its settings.

    Attributes:
        name: How tables call it: the profile's file name without ``.toml``, or the backend's name.
        settings: The backend's name and its settings, as ``ftqp.qp.backend`` takes them.
    """

    name: str
    settings: dict[str, Any]

    def made(self) -> Backend:
        """A fresh backend.

        Raises:
            FtqpError: It cannot take part; the message says why.
        """
        return backend(self.settings)


def profile_names() -> tuple[str, ...]:
    """The profiles that come with the bench, the reference first, then by name."""
    names = sorted(file.stem for file in PROFILES.glob("*.toml"))
    return tuple(sorted(names, key=lambda name: name != REFERENCE))


def contenders(names: Sequence[str] | None = None, *, quick: bool = False) -> list[Contender]:
    """The contenders of these names; every profile when there are none.

    Args:
        names: Each the name of a profile, of a backend (then with its default settings), or the path of a
            profile elsewhere.
        quick: Leave the slow profiles out of "every profile", those of papers.

    Raises:
        InputError: No such backend or profile, or one that sets an unknown key.
    """
    if names is None:
        chosen = [name for name in profile_names() if not (quick and PAPER in name)]
        return [_profiled(PROFILES / f"{name}.toml") for name in chosen]
    return [_contender(name) for name in dict.fromkeys(names)]


def split(contenders: Sequence[Contender]) -> tuple[list[Contender], dict[str, str]]:
    """Those who can take part, and why the others cannot, by name."""
    ready, declined = [], {}
    for contender in contenders:
        try:
            contender.made()
        except FtqpError as error:
            declined[contender.name] = str(error)
        else:
            ready.append(contender)
    return ready, declined


def _contender(name: str) -> Contender:
    if name.endswith(".toml"):
        return _profiled(Path(name))
    if name in profile_names():
        return _profiled(PROFILES / f"{name}.toml")
    try:
        backend(name)
    except MissingPackage:
        pass  # it exists and will say itself what it needs
    except InputError as error:
        if name.startswith("qpsolvers:"):
            raise
        raise unknown("backend or profile", name, "the bench", _valid()) from error
    return Contender(name=name, settings={"name": name})


def _profiled(file: Path) -> Contender:
    settings = profile(file)
    try:
        backend(settings)
    except MissingPackage:
        pass  # as above
    except InputError as error:
        raise InputError(f"profile {file.name}: {error}") from error
    return Contender(name=file.stem, settings=settings)


def _valid() -> list[str]:
    return list(dict.fromkeys([*profile_names(), *backend_names()]))
