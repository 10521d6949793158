"""Compiled code that takes numbers from a Python object; see ``ftqp.kernel.compiled.taking``."""

import ctypes
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from ftqp.kernel.compiled.facts import (
    BAD_BUFFER,
    CONTIGUOUS,
    DATA_AT,
    DTYPE_AT,
    FLAGS_AT,
    FLOAT64,
    NDARRAY,
    NDIM_AT,
    SHAPE_AT,
    SIZE,
    SYMBOL,
    fill,
)
from ftqp.kernel.compiled.making.helper import helper

_C_CONTIGUOUS_WITH_FORMAT = 0x38 | 0x04  # PyBUF_C_CONTIGUOUS | PyBUF_FORMAT

_NATIVE, _STANDARD, _LITTLE_ENDIAN, _DOUBLE = (ord(letter) for letter in "@=<d")

_LONG, _BYTE = ir.IntType(64), ir.IntType(8)
_OBJECT = _BYTE.as_pointer()
_BUFFER_SIZE = 80  # sizeof(Py_buffer): buf, obj, len, itemsize, readonly + ndim, format, shape, ...

_TABLE = (ctypes.c_int64 * SIZE)()
fill(ctypes.addressof(_TABLE))
llvm.add_symbol(SYMBOL, ctypes.addressof(_TABLE))  # for functions that Python calls one by one


@intrinsic  # type: ignore[untyped-decorator]
def _long(context: Any, address: Any) -> Any:
    """The 64-bit integer at an address."""

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.load(builder.inttoptr(arguments[0], _LONG.as_pointer()), align=1)

    return types.int64(types.int64), code


@intrinsic  # type: ignore[untyped-decorator]
def _int(context: Any, address: Any) -> Any:
    """The 32-bit integer at an address."""

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        kind = ir.IntType(32)
        value = builder.load(builder.inttoptr(arguments[0], kind.as_pointer()), align=1)
        return builder.sext(value, _LONG)

    return types.int64(types.int64), code


@intrinsic  # type: ignore[untyped-decorator]
def _byte(context: Any, address: Any) -> Any:
    """The byte at an address."""

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.zext(builder.load(builder.inttoptr(arguments[0], _OBJECT)), _LONG)

    return types.int64(types.int64), code


@intrinsic  # type: ignore[untyped-decorator]
def _fact(context: Any, index: Any) -> Any:
    """A number of the table of facts about this process."""

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        kind = ir.ArrayType(_LONG, SIZE)
        table = builder.module.globals.get(SYMBOL) or ir.GlobalVariable(builder.module, kind, SYMBOL)
        return builder.load(builder.gep(table, [_LONG(0), arguments[0]]))

    return types.int64(types.int64), code


@intrinsic  # type: ignore[untyped-decorator]
def _copy(context: Any, into: Any, source: Any, size: Any) -> Any:
    """Copy bytes from one address to another; they may overlap."""

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(_OBJECT, [_OBJECT, _OBJECT, _LONG])
        move = cgutils.get_or_insert_function(builder.module, kind, "memmove")
        into_at, source_at, size = arguments
        builder.call(move, [builder.inttoptr(into_at, _OBJECT), builder.inttoptr(source_at, _OBJECT), size])
        return _context.get_dummy_value()

    return types.none(types.int64, types.int64, types.int64), code


@intrinsic  # type: ignore[untyped-decorator]
def _open_buffer(context: Any, source: Any) -> Any:
    """The address of a buffer view of the object (``Py_buffer``), or 0; no Python error is left."""

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        view = cgutils.alloca_once(builder, ir.ArrayType(_BYTE, _BUFFER_SIZE))
        view.align = 16
        place = builder.bitcast(view, _OBJECT)
        number = ir.IntType(32)
        open_it = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(number, [_OBJECT, _OBJECT, number]), "PyObject_GetBuffer"
        )
        forget = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(ir.VoidType(), []), "PyErr_Clear"
        )
        source_at = builder.inttoptr(arguments[0], _OBJECT)
        answer = builder.call(open_it, [source_at, place, number(_C_CONTIGUOUS_WITH_FORMAT)])
        failed = builder.icmp_signed("!=", answer, number(0))
        with builder.if_then(failed, likely=False):
            builder.call(forget, [])
        return builder.select(failed, _LONG(0), builder.ptrtoint(place, _LONG))

    return types.int64(types.int64), code


@intrinsic  # type: ignore[untyped-decorator]
def _close_buffer(context: Any, view: Any) -> Any:
    """Give a buffer view back."""

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        close = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(ir.VoidType(), [_OBJECT]), "PyBuffer_Release"
        )
        builder.call(close, [builder.inttoptr(arguments[0], _OBJECT)])
        return _context.get_dummy_value()

    return types.none(types.int64), code


@helper
def _holds_float64(view: int) -> bool:
    """Whether a buffer view has at least one dimension and elements of float64 in native byte order."""
    if _long(view + 24) != 8 or _int(view + 36) < 1:
        return False
    name = _long(view + 40)
    if name == 0:
        return False
    first = _byte(name)
    if first == _NATIVE or first == _STANDARD or first == _LITTLE_ENDIAN:
        name += 1
        first = _byte(name)
    return first == _DOUBLE and _byte(name + 1) == 0


@helper
def _take_buffer(source: int, first: int, into: int, count: int, dimensions: int) -> int:
    view = _open_buffer(source)
    if view == 0:
        return BAD_BUFFER
    found = BAD_BUFFER
    if _holds_float64(view) and (dimensions == 0 or _int(view + 36) == dimensions):
        shape = _long(view + 48)
        if dimensions == 2 and (shape == 0 or _long(shape) != _long(shape + 8)):
            _close_buffer(view)
            return BAD_BUFFER
        found = max(_long(view + 16) // 8 - first, 0)
        _copy(into, _long(view) + 8 * first, 8 * min(found, count))
    _close_buffer(view)
    return found


@helper
def take(source: int, first: int, into: int, count: int, dimensions: int) -> int:
    """Copy numbers out of a Python object: how many it has from ``first`` on, or ``BAD_BUFFER``.

    An exact array is read where its fields lie, everything else through the buffer protocol. Needs the
    interpreter's lock. No Python error is left behind.

    Args:
        source: the object's address (in plain Python: the object); an array of float64, or any other
            C-contiguous buffer of them with at least one dimension.
        first: index of the first number, in the order of memory.
        into: the address that the numbers go to.
        count: how many fit there; of more, only the first are copied.
        dimensions: how many the buffer must have; 0 takes any, and 2 takes square matrices only.
    """
    if (
        _long(source + 8) == _fact(NDARRAY)
        and _long(source + DTYPE_AT) == _fact(FLOAT64)
        and _int(source + FLAGS_AT) & CONTIGUOUS
    ):
        axes = _int(source + NDIM_AT)
        if axes > 0 and (dimensions == 0 or dimensions == axes):
            shape = _long(source + SHAPE_AT)
            found = _long(shape)
            if dimensions == 2 and found != _long(shape + 8):
                return BAD_BUFFER
            for k in range(1, axes):
                found *= _long(shape + 8 * k)
            found = max(found - first, 0)
            _copy(into, _long(source + DATA_AT) + 8 * first, 8 * min(found, count))
            return found
    return _take_buffer(source, first, into, count, dimensions)
