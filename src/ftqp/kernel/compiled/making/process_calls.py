"""Compiled code for what the kernel asks of the process around it; see ``ftqp.kernel.compiled.calling``."""

import sys
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from ftqp.kernel.compiled.facts import CALL_FAILED

_MONOTONIC = {"linux": 1, "darwin": 6}.get(sys.platform)
"""CLOCK_MONOTONIC of the C library; None where there is none."""

_LONG, _INT = ir.IntType(64), ir.IntType(32)
_OBJECT = ir.IntType(8).as_pointer()


def _c_function(builder: Any, name: str, result: Any, *arguments: Any) -> Any:
    """The result of a C function."""
    kind = ir.FunctionType(result, [argument.type for argument in arguments])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), arguments)


@intrinsic  # type: ignore[untyped-decorator]
def tick_of(context: Any, function: Any, q: Any, v: Any, targets: Any, row: Any) -> Any:
    """The status that a Python function gives for (q, v, targets, row); CALL_FAILED when it raises.

    The first four are addresses of Python objects, the last one is a number. The caller holds the
    interpreter's lock.
    """

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        objects = [builder.inttoptr(argument, _OBJECT) for argument in arguments[:4]]
        number = _c_function(builder, "PyLong_FromLongLong", _OBJECT, arguments[4])
        places = cgutils.alloca_once(builder, ir.ArrayType(_OBJECT, 4))
        for index, value in enumerate((*objects[1:], number)):
            builder.store(value, builder.gep(places, [_LONG(0), _LONG(index)]))
        first = builder.gep(places, [_LONG(0), _LONG(0)])
        answer = _c_function(
            builder, "PyObject_Vectorcall", _OBJECT, objects[0], first, _LONG(4), _OBJECT(None)
        )
        _c_function(builder, "Py_DecRef", ir.VoidType(), number)
        status = cgutils.alloca_once_value(builder, _LONG(CALL_FAILED))
        missing = builder.icmp_unsigned("==", answer, _OBJECT(None))
        with builder.if_else(missing, likely=False) as (raised, answered):
            with raised:
                _c_function(builder, "PyErr_Clear", ir.VoidType())
            with answered:
                builder.store(_c_function(builder, "PyLong_AsLongLong", _LONG, answer), status)
                _c_function(builder, "Py_DecRef", ir.VoidType(), answer)
        return builder.load(status)

    return types.int64(types.int64, types.int64, types.int64, types.int64, types.int64), code


@intrinsic  # type: ignore[untyped-decorator]
def nanoseconds(context: Any) -> Any:
    """A clock that only goes forward [ns]; 0 on a platform whose C library has none."""

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        if _MONOTONIC is None:
            return _LONG(0)
        time = cgutils.alloca_once(builder, ir.ArrayType(_LONG, 2))
        first = builder.gep(time, [_LONG(0), _LONG(0)])
        _c_function(builder, "clock_gettime", _INT, _INT(_MONOTONIC), first)
        seconds = builder.load(first)
        rest = builder.load(builder.gep(time, [_LONG(0), _LONG(1)]))
        return builder.add(builder.mul(seconds, _LONG(1_000_000_000)), rest)

    return types.int64(), code
