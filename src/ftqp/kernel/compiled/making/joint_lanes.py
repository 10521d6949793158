"""Eight neighbours of an array of a record as ``Lanes``: what all joints have in common, at once."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np import arrayobj

from ftqp.kernel.compiled.making.lane_numbers import (
    DOUBLE,
    DOUBLES,
    LANES,
    LONG,
    LONGS,
    MASK,
    WIDTH,
    everywhere,
)


def _place(context: Any, builder: Any, kind: Any, array: Any, at: Any) -> Any:
    """Where eight elements of a one-dimensional array lie, from ``at`` on."""
    data = arrayobj.make_array(kind)(context, builder, array).data
    vector = DOUBLES if kind.dtype == types.float64 else LONGS
    return builder.bitcast(builder.gep(data, [at], inbounds=True), vector.as_pointer())


def _is_row(kind: Any, dtype: Any) -> bool:
    return isinstance(kind, types.Array) and kind.ndim == 1 and kind.layout == "C" and kind.dtype == dtype


@intrinsic  # type: ignore[untyped-decorator]
def load_lanes(context: Any, array: Any, at: Any) -> Any:
    """Eight numbers of a one-dimensional array of float64, from ``at`` on."""
    if not _is_row(array, types.float64):
        return None

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return builder.load(_place(context, builder, sig.args[0], *arguments), align=8)

    return LANES(array, types.intp), code


@intrinsic  # type: ignore[untyped-decorator]
def store_lanes(context: Any, array: Any, at: Any, lanes: Any) -> Any:
    """Write eight numbers into a one-dimensional array of float64, from ``at`` on."""
    if not _is_row(array, types.float64):
        return None

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        *where, value = arguments
        builder.store(value, _place(context, builder, sig.args[0], *where), align=8)
        return context.get_dummy_value()

    return types.none(array, types.intp, LANES), code


@intrinsic  # type: ignore[untyped-decorator]
def is_set(context: Any, array: Any, at: Any) -> Any:
    """Which of eight whole numbers of a one-dimensional array are not 0."""
    if not _is_row(array, types.int64):
        return None

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        value = builder.load(_place(context, builder, sig.args[0], *arguments), align=8)
        return builder.icmp_signed("!=", value, ir.Constant(LONGS, [0] * WIDTH))

    return MASK(array, types.intp), code


@intrinsic  # type: ignore[untyped-decorator]
def put_either(context: Any, array: Any, at: Any, condition: Any, one: Any, other: Any) -> Any:
    """Write eight whole numbers: ``one`` where a condition holds, elsewhere ``other``."""
    if not _is_row(array, types.int64):
        return None

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        array, at, condition, *values = arguments
        first, second = (everywhere(builder, value, LONGS) for value in values)
        chosen = builder.select(condition, first, second)
        builder.store(chosen, _place(context, builder, sig.args[0], array, at), align=8)
        return context.get_dummy_value()

    return types.none(array, types.intp, MASK, types.int64, types.int64), code


@intrinsic  # type: ignore[untyped-decorator]
def lane_mask(context: Any, count: Any, at: Any) -> Any:
    """Which of the indices at .. at + 7 are below a count."""

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        count, at = arguments
        left = everywhere(builder, builder.sub(count, at), LONGS)
        return builder.icmp_signed("<", ir.Constant(LONGS, [LONG(k) for k in range(WIDTH)]), left)

    return MASK(types.int64, types.int64), code


@intrinsic  # type: ignore[untyped-decorator]
def numbers(context: Any, at: Any) -> Any:
    """The indices at .. at + 7."""

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        first = everywhere(builder, builder.sitofp(arguments[0], DOUBLE), DOUBLES)
        return builder.fadd(first, ir.Constant(DOUBLES, [DOUBLE(float(k)) for k in range(WIDTH)]))

    return LANES(types.int64), code


def _folded(builder: Any, value: Any, fold: Any) -> Any:
    """All lanes brought into one by halves: the upper half onto the lower, until one is left."""
    width = WIDTH
    while width > 1:
        width //= 2
        undefined = ir.Constant(value.type, ir.Undefined)
        number = ir.VectorType(ir.IntType(32), width)
        low = builder.shuffle_vector(value, undefined, ir.Constant(number, list(range(width))))
        high = builder.shuffle_vector(value, undefined, ir.Constant(number, list(range(width, 2 * width))))
        value = fold(low, high)
    return builder.extract_element(value, ir.IntType(32)(0))


@intrinsic  # type: ignore[untyped-decorator]
def sum_of(context: Any, lanes: Any) -> Any:
    """The sum of all lanes."""

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return _folded(builder, arguments[0], builder.fadd)

    return types.float64(lanes), code


@intrinsic  # type: ignore[untyped-decorator]
def largest_of(context: Any, lanes: Any) -> Any:
    """The largest of all lanes; one that is NaN may be passed over."""

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        def larger(a: Any, b: Any) -> Any:
            return builder.select(builder.fcmp_ordered(">", b, a), b, a)

        return _folded(builder, arguments[0], larger)

    return types.float64(lanes), code
