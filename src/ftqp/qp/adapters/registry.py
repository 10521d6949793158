"""Backends by name: what there is, what is missing and how to install it."""

import logging
import sys
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from ftqp.core.errors import InputError, MissingPackage, unknown
from ftqp.core.extras import remedy_for_extra
from ftqp.qp import adapters
from ftqp.qp.adapters.backend import Backend, settings


def profile(path: str | Path) -> dict[str, Any]:
    """The content of a profile, to be handed to ``ftqp.qp.backend``: name = "osqp", tolerance = 1e-9."""
    path = Path(path)
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise InputError(f"profile {path} is not a regular file; expected a TOML file")
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        reason = error.strerror or error
        raise InputError(f"profile {path} cannot be read ({reason}); expected a TOML file") from error
    except (ValueError, RecursionError) as error:  # it is no text, or no TOML
        raise InputError(f"profile {path} is not valid TOML: {error}") from error
    if "name" not in content:
        raise InputError(f'profile {path} has no name; expected a line like name = "daqp"')
    return content


EXTRA = "solvers"
"""The extra that brings the packages of the backends."""
QPSOLVERS = "qpsolvers"
PREFIX = f"{QPSOLVERS}:"
IN_KERNEL = "in the kernel"
NATIVE = "native"
ADAPTED = "through qpsolvers"
PACKAGE = "proxsuite"
FAST_BUILDS = ("proxsuite.proxsuite_pywrap_avx512", "proxsuite.proxsuite_pywrap_avx2")
"""Builds of proxsuite that keep some arrays where malloc puts them, aligned to 16 bytes.

Eigen sums numbers one by one up to the first address that is aligned to its own width, 32 or 64 bytes, and in
packets from there on. So the same input gives sums of another rounding when malloc happens to answer
otherwise, and an iteration that stops at a threshold stops elsewhere. The build for any x86 processor has a
width of 16 bytes, where nothing is left to chance.
"""

_LOG = logging.getLogger(__name__)


class _Entry(NamedTuple):
    cls: str
    imports: str
    distribution: str
    licence: str
    kind: str = NATIVE


# A backend is one file in ftqp.qp.adapters and one line here.
_ENTRIES = {
    "active_set": _Entry("ActiveSet", "numpy", "ftqp", "Apache-2.0", IN_KERNEL),
    "dtrnn": _Entry("Dtrnn", "numpy", "ftqp", "Apache-2.0", IN_KERNEL),
    "daqp": _Entry("Daqp", "daqp", "daqp", "MIT"),
    "osqp": _Entry("Osqp", "osqp", "osqp", "Apache-2.0"),
    "proxqp": _Entry("Proxqp", "proxsuite", "proxsuite", "BSD-2-Clause"),
    "quadprog": _Entry("Quadprog", "quadprog", "quadprog", "GPL-2.0-or-later"),
}
_QPSOLVERS = _Entry("Qpsolvers", "qpsolvers", "qpsolvers", "LGPL-3.0", ADAPTED)


@dataclass(frozen=True, slots=True, kw_only=True)
class BackendInfo:
    """A row of the table of backends.

    Attributes:
        name: The name by which the backend is asked for.
        kind: ``in the kernel``, ``native`` (set up once, then updated) or ``through qpsolvers``.
        licence: The SPDX name of the package's licence; behind qpsolvers the solver has its own as well.
        version: The version of the package, None when it is not installed.
        available: Whether the backend can be used now.
        reason: Why it cannot; empty when it can.
        install: The command that installs it; empty for what is always there.
    """

    name: str
    kind: str
    licence: str
    version: str | None
    available: bool
    reason: str
    install: str


def backend(spec: str | Path | Mapping[str, Any] | Backend) -> Backend:
    """A backend that is not yet set up.

    Args:
        spec: A name (``"daqp"``, ``"qpsolvers:clarabel"``), a mapping with ``name`` and settings (``{"name":
            "osqp", "tolerance": 1e-9}``), the path of a TOML profile that holds the same, or a backend, which
            is returned as it is.

    Raises:
        InputError: A name or setting is unknown (the message has the nearest valid one), a value is out of
            range, or the profile cannot be read.
        MissingPackage: The solver's package is not installed.
    """
    if isinstance(spec, Backend):
        return spec
    if isinstance(spec, Path) or (isinstance(spec, str) and spec.endswith(".toml")):
        return backend(profile(spec))
    if isinstance(spec, str):
        return _made(spec, {})
    if not isinstance(spec, Mapping):
        raise InputError(
            f"backend is {spec!r:.80}, expected a name, a mapping with a name, or the path of a profile"
        )
    given = dict(spec)
    name = given.pop("name", None)
    if not isinstance(name, str):
        raise InputError(f"backend {dict(spec)!r:.80} has no name; expected a key 'name' like 'daqp'")
    return _made(name, given)


def backends() -> list[BackendInfo]:
    """Every backend, with what is missing and how to install it; loads qpsolvers to ask what it finds."""
    rows = [_info(name, entry) for name, entry in _ENTRIES.items()]
    adapter = _info(f"{PREFIX}<name>", _QPSOLVERS)
    if not adapter.available:
        return [*rows, adapter]
    names = _module(QPSOLVERS, _QPSOLVERS).solver_names()
    return rows + [_info(f"{PREFIX}{name}", _QPSOLVERS) for name in names]


def backend_names() -> tuple[str, ...]:
    """The names a user can write; the last stands for any solver of qpsolvers."""
    return (*_ENTRIES, f"{PREFIX}<name>")


def _made(name: str, given: Mapping[str, Any]) -> Backend:
    adapted = name.startswith(PREFIX)
    if not adapted and name not in _ENTRIES:
        raise unknown("backend", name, "ftqp", backend_names())
    entry = _QPSOLVERS if adapted else _ENTRIES[name]
    try:
        cls: Any = getattr(_module(QPSOLVERS if adapted else name, entry), entry.cls)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] == "ftqp":
            raise
        raise MissingPackage(f"backend {name!r}", error.name, remedy_for_extra(EXTRA)) from error
    made: Backend = (
        cls(name.removeprefix(PREFIX), given)
        if adapted
        else cls(name, settings(cls.settings_type, name, given))
    )
    return made


def _module(name: str, entry: _Entry) -> ModuleType:
    """The adapter's module; what it needs of others is loaded with it."""
    path = f"{adapters.__name__}._{name}"
    if path in sys.modules or entry.imports not in (PACKAGE, QPSOLVERS):
        return import_module(path)
    with _steady_rounding():
        return import_module(path)


def _info(name: str, entry: _Entry) -> BackendInfo:
    available = find_spec(entry.imports) is not None
    try:
        found = version(entry.distribution) if available else None
    except PackageNotFoundError:
        found = None
    return BackendInfo(
        name=name,
        kind=entry.kind,
        licence=entry.licence,
        version=found,
        available=available,
        reason="" if available else f"package {entry.imports!r} is not installed",
        install="" if entry.kind == IN_KERNEL else remedy_for_extra(EXTRA),
    )


@contextmanager
def _steady_rounding() -> Iterator[None]:
    """Loads proxsuite whose answers do not depend on addresses; another that is there stays."""
    if PACKAGE in sys.modules:
        if any(sys.modules.get(build) is not None for build in FAST_BUILDS):
            _LOG.warning(
                "proxsuite was loaded before ftqp, in a build whose rounding depends on where its memory "
                "lies: proxqp may answer the same QP differently in the last digits; make the planner "
                "before importing proxsuite, pink or qpsolvers"
            )
        yield
        return
    kept_out = [build for build in FAST_BUILDS if build not in sys.modules]
    for build in kept_out:
        sys.modules[build] = None  # type: ignore[assignment]  # so that importing it fails as if not installed
    try:
        yield
    finally:
        for build in kept_out:
            sys.modules.pop(build, None)
