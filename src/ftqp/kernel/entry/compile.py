"""Compiling the entry points once, with fixed types: a wrong dtype is an error, not a recompilation."""

from collections.abc import Callable, Iterable
from typing import Any

from ftqp.kernel.entry import entries as entry
from ftqp.kernel.jit import COMPILED, cache_folder

STEP = ("step", "path_target")
EXTERNAL = ("prepare_external", "finish_external")
BASE = ("base_finish",)
SETUP = ("kinematics", "inverse_dynamics", "torques", "measures")
CLOSED_FORM = ("step_closed_form",)
NETWORK = ("step_dtrnn",)
RATES = ("resolve_reduced", "damping")
_SIGNATURES = {
    "step": "iiiii",
    "path_target": "iiii",
    "prepare_external": "iiiiia",
    "finish_external": "iaii",
    "step_dtrnn": "iiiii",
    "kinematics": "iaa",
    "inverse_dynamics": "iaa",
    "torques": "i",
    "base_finish": "i",
    "measures": "ii",
    "step_closed_form": "iiiii",
    "resolve_reduced": "i",
    "damping": "i",
}


def _dispatcher(name: str) -> Any:
    """The entry point of that name; the network's module is loaded by those who use it."""
    if name in NETWORK:
        from ftqp.kernel.entry import network_entries as dtrnn_entry

        return getattr(dtrnn_entry, name)
    return getattr(entry, name)


def missing(names: Iterable[str]) -> list[str]:
    """The entry points among ``names`` without compiled code, in this process and on disk."""
    if not COMPILED:
        return []
    folder = cache_folder()
    stored = (
        {path.name.split("-")[0].split(".")[-1] for path in folder.rglob("*.nbi")}
        if folder.is_dir()
        else set()
    )
    return [name for name in names if not _dispatcher(name).signatures and name not in stored]


def compile_entries(names: Iterable[str], announce: Callable[[], Any] | None = None) -> None:
    """Compile, or load from disk, the entry points ``names``; further types are refused from then on.

    Args:
        names: among ``STEP``, ``EXTERNAL``, ``NETWORK``, ``SETUP``, ``CLOSED_FORM``, ``BASE`` and ``RATES``.
        announce: makes a context manager that is entered while something has to be compiled.
    """
    if not COMPILED:
        return
    todo = [name for name in names if not _dispatcher(name).signatures]
    if not todo:
        return
    if announce is not None and missing(todo):
        with announce():
            _compile(todo)
    else:
        _compile(todo)


def _compile(names: list[str]) -> None:
    from numba import float64, int64

    kinds = {"i": int64, "a": float64[::1]}
    for name in names:
        dispatcher: Any = _dispatcher(name)
        dispatcher.compile(tuple(kinds[letter] for letter in _SIGNATURES[name]))
        dispatcher.disable_compile()


def fast_call(name: str) -> Callable[..., Any]:
    """The compiled code of an entry point that takes integers only, without numba's dispatch on types.

    The types cannot be wrong: every argument is an address or a count that the planner itself provides.
    """
    dispatcher: Any = _dispatcher(name)
    compiled = list(getattr(dispatcher, "overloads", {}).values())
    direct: Callable[..., Any] = (
        getattr(compiled[0], "entry_point", dispatcher) if len(compiled) == 1 else dispatcher
    )
    return direct
