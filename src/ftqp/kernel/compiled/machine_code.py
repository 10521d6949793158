"""Machine code made callable: object files linked into this process, addresses made Python functions."""

import ctypes
import sys
from collections.abc import Callable
from functools import cache
from typing import Any

from ftqp.kernel.compiled.facts import TABLE, fill
from ftqp.kernel.compiled.symbols import symbols_of

METH_FASTCALL = 0x80


class _MethodDefinition(ctypes.Structure):
    """``PyMethodDef``."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("function", ctypes.c_void_p),
        ("flags", ctypes.c_int),
        ("doc", ctypes.c_char_p),
    )


def function_at(address: int, name: str, owner: Any) -> Callable[..., int]:
    """The C function at an address (``METH_FASTCALL``) as a Python function.

    Args:
        address: of ``PyObject *f(PyObject *self, PyObject **arguments, Py_ssize_t count)``.
        name: what the function is called.
        owner: of the code; it stays alive for good, as machine code in use cannot be taken back.
    """
    definition = _MethodDefinition(name.encode(), address, METH_FASTCALL, None)
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(definition))
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(owner))
    new = ctypes.pythonapi["PyCFunction_NewEx"]
    new.restype = ctypes.py_object
    new.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
    function: Callable[..., int] = new(ctypes.addressof(definition), None, None)
    return function


def linked_function(code: bytes, symbol: str) -> Callable[..., int] | None:
    """The entry point in an object file, linked into this process; ``None`` where it does not fit.

    Args:
        code: the object file.
        symbol: of the function in it.
    """
    import llvmlite.binding as llvm

    from ftqp.kernel.compiled.making.processor import this_machine

    try:
        symbols = symbols_of(code)
    except ValueError:
        return None
    machine = this_machine().machine()
    if symbols is not None:
        if not {symbol, symbol + TABLE} <= symbols.defined:
            return None
        for name in symbols.needed:
            if llvm.address_of_symbol(name) is None and not _provide(llvm, name):
                return None
    try:
        # sections close together: the code reaches its constants by 32-bit distances
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine, use_lmm=True)
        engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        engine.finalize_object()
        address = engine.get_function_address(symbol)
        table = engine.get_global_value_address(symbol + TABLE)
    except RuntimeError:
        return None
    if not address or not table:
        return None
    fill(table)
    return function_at(address, symbol, engine)


def _provide(llvm: Any, name: str) -> bool:
    """Tell LLVM of a symbol that it does not find by itself: Python's, or of the mathematical library."""
    for library in (ctypes.pythonapi, _mathematics()):
        try:
            address = ctypes.cast(getattr(library, name), ctypes.c_void_p).value
        except AttributeError:
            continue
        llvm.add_symbol(name, address)
        return True
    return name == "_GLOBAL_OFFSET_TABLE_"


@cache
def _mathematics() -> Any:
    """The C library's mathematical functions, which Python itself need not have loaded for all to see."""
    for name in {"win32": ("ucrtbase",), "darwin": ("libSystem.dylib",)}.get(
        sys.platform, ("libm.so.6", "libm.so")
    ):
        try:
            return ctypes.CDLL(name)
        except OSError:
            continue
    return None
