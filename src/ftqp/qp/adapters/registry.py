"""Backends by name: what there is, what is missing and how to install it."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

from ftqp.core.errors import InputError, MissingPackage, unknown
from ftqp.core.extras import remedy_for_extra
from ftqp.qp.adapters.backend import Backend
from ftqp.qp.adapters.backend_settings import settings
from ftqp.qp.adapters.profile import profile
from ftqp.qp.adapters.steady_rounding import PACKAGE, steady_rounding

EXTRA = "solvers"
"""The extra that brings the packages of the backends."""
PREFIX = "qpsolvers:"
IN_KERNEL = "in the kernel"
NATIVE = "native"
ADAPTED = "through qpsolvers"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Entry:
    module: str
    cls: str
    imports: str
    distribution: str
    licence: str
    kind: str = NATIVE


# A backend is one file in ftqp.qp.adapters and one line here.
_ENTRIES = {
    "active_set": _Entry(
        module="_active_set",
        cls="ActiveSet",
        imports="numpy",
        distribution="ftqp",
        licence="Apache-2.0",
        kind=IN_KERNEL,
    ),
    "dtrnn": _Entry(
        module="_dtrnn",
        cls="Dtrnn",
        imports="numpy",
        distribution="ftqp",
        licence="Apache-2.0",
        kind=IN_KERNEL,
    ),
    "daqp": _Entry(module="_daqp", cls="Daqp", imports="daqp", distribution="daqp", licence="MIT"),
    "osqp": _Entry(module="_osqp", cls="Osqp", imports="osqp", distribution="osqp", licence="Apache-2.0"),
    "proxqp": _Entry(
        module="_proxqp", cls="Proxqp", imports="proxsuite", distribution="proxsuite", licence="BSD-2-Clause"
    ),
    "quadprog": _Entry(
        module="_quadprog",
        cls="Quadprog",
        imports="quadprog",
        distribution="quadprog",
        licence="GPL-2.0-or-later",
    ),
}

_QPSOLVERS = _Entry(
    module="_qpsolvers",
    cls="Qpsolvers",
    imports="qpsolvers",
    distribution="qpsolvers",
    licence="LGPL-3.0",
    kind=ADAPTED,
)


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
    names = _module(_QPSOLVERS).solver_names()
    return rows + [_info(f"{PREFIX}{name}", _QPSOLVERS) for name in names]


def backend_names() -> tuple[str, ...]:
    """The names a user can write; the last stands for any solver of qpsolvers."""
    return (*_ENTRIES, f"{PREFIX}<name>")


def _made(name: str, given: Mapping[str, Any]) -> Backend:
    if name.startswith(PREFIX):
        made: Backend = _class(name, _QPSOLVERS)(name.removeprefix(PREFIX), given)
        return made
    if name not in _ENTRIES:
        raise unknown("backend", name, "ftqp", backend_names())
    cls = _class(name, _ENTRIES[name])
    made = cls(settings(cls.settings_type, name, given))
    return made


def _module(entry: _Entry) -> ModuleType:
    """The adapter's module; what it needs of others is loaded with it."""
    name = f"ftqp.qp.adapters.{entry.module}"
    if name in sys.modules or entry.imports not in (PACKAGE, _QPSOLVERS.imports):
        return import_module(name)
    with steady_rounding():
        return import_module(name)


def _class(name: str, entry: _Entry) -> Any:
    try:
        module = _module(entry)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] == "ftqp":
            raise
        raise MissingPackage(f"backend {name!r}", error.name, remedy_for_extra(EXTRA)) from error
    return getattr(module, entry.cls)


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
