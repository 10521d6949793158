"""What the machine code of a function depends on, as a hash: its bytecode and that of all that it reaches.

Comments and docstrings are no part of it, and neither is a helper that lies apart, but for its name and what
it returns.
"""

import enum
import hashlib
import sys
from collections.abc import Iterator
from functools import cache
from types import CodeType, FunctionType, ModuleType
from typing import Any

import llvmlite
import numba
import numpy as np

from ftqp.kernel.compiled.library import code_text
from ftqp.kernel.compiled.making.helper import Helper
from ftqp.kernel.compiled.mode import KERNEL

_MAKING = "compiled/making"
_MAKERS = (
    f"{_MAKING}/emit.py",
    f"{_MAKING}/helper.py",
    f"{_MAKING}/joint_lanes.py",
    f"{_MAKING}/lane_numbers.py",
    "compiled/glue.py",
    "jit.py",
)
"""The files that say how a function becomes machine code."""
_NAMES = ("__module__", "__qualname__")


def fingerprint(function: Any, *beside: Any) -> str:
    """A hash of a function and of everything that its code is made from, in hexadecimal."""
    text = "\n".join([_maker(), *map(str, beside), *_function(getattr(function, "py_func", function), set())])
    return hashlib.sha256(text.encode()).hexdigest()[:24]


@cache
def _maker() -> str:
    """Whatever makes machine code of functions, here and in other packages."""
    texts = [code_text(KERNEL / name) for name in _MAKERS]
    return f"{sys.version_info[:2]} {numba.__version__} {llvmlite.__version__} {texts}"


def _function(function: FunctionType, seen: set[int]) -> Iterator[str]:
    if id(function) in seen:
        yield f"again {function.__qualname__}"
        return
    seen.add(id(function))
    yield f"function {function.__module__} {function.__qualname__} {function.__defaults__}"
    names: list[str] = []
    yield from _code(function.__code__, function.__doc__, names)
    for cell in function.__closure__ or ():
        yield from _thing(cell.cell_contents, seen)
    for name in dict.fromkeys(names):
        if name in function.__globals__:
            yield f"global {name}"
            yield from _thing(function.__globals__[name], seen)


def _code(code: CodeType, doc: str | None, names: list[str]) -> Iterator[str]:
    """Bytecode without docstring and places in the file; the names that it uses are added to a list."""
    names.extend(code.co_names)
    yield f"{code.co_code.hex()} {code.co_names} {code.co_varnames} {code.co_freevars} {code.co_cellvars}"
    for number, constant in enumerate(code.co_consts):
        if isinstance(constant, CodeType):
            inner = constant.co_consts[0] if constant.co_consts else None
            yield from _code(constant, inner if isinstance(inner, str) else None, names)
        elif number or doc is None or constant != doc:
            yield repr(sorted(map(repr, constant)) if isinstance(constant, frozenset) else constant)


def _thing(thing: Any, seen: set[int]) -> Iterator[str]:
    """What a name in a function, or a cell of its closure, stands for."""
    if isinstance(thing, Helper):
        function = thing.py_func
        yield f"helper {thing.apart} {bool(thing.targetoptions.get('fastmath'))}"
        if thing.apart:
            yield f"{function.__module__} {function.__qualname__} {function.__annotations__.get('return')}"
        else:
            yield from _function(function, seen)
    elif isinstance(thing, FunctionType):
        if thing.__module__.startswith("ftqp."):
            yield from _function(thing, seen)
        else:
            yield f"{thing.__module__}.{thing.__qualname__}"
    elif isinstance(thing, np.ndarray):
        yield f"array {thing.dtype} {thing.shape} {thing.tobytes().hex()}"
    elif isinstance(thing, bool | int | float | str | bytes | None | enum.Enum | np.dtype | np.generic):
        yield repr(thing)
    elif isinstance(thing, tuple | list):
        yield f"{type(thing).__name__} of {len(thing)}"
        for part in thing:
            yield from _thing(part, seen)
    elif isinstance(thing, ModuleType):
        yield f"module {thing.__name__}"
    elif hasattr(thing, "_defn"):  # an intrinsic of numba's
        yield "intrinsic"
        yield from _function(thing._defn, seen)
    else:
        yield " ".join([type(thing).__name__, *(str(getattr(thing, name, "")) for name in _NAMES)])
