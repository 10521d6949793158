"""Eight neighbours of an array of a record as ``Lanes``: what one arm's joints have in common, at once.

An array of a lane record has eight arms a joint already: there the same functions take one joint at a time.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np import arrayobj

from ftqp.kernel.compiled.making.lane_numbers import BIT, DOUBLE, LONG, LanesType, MaskType
from ftqp.kernel.compiled.making.lane_records import LaneArrayType, load_lanes, store_lanes

WIDTH = 8
"""Joints side by side: a vector register of AVX-512; of smaller ones the compiler takes several."""

_PLACES = [LONG(k) for k in range(WIDTH)]
_LONGS, _DOUBLES, _BITS = (ir.VectorType(kind, WIDTH) for kind in (LONG, DOUBLE, BIT))


def _place(context: Any, builder: Any, kind: Any, array: Any, at: Any) -> Any:
    """Where eight elements of a one-dimensional array lie, from ``at`` on."""
    data = arrayobj.make_array(kind)(context, builder, array).data
    vector = _DOUBLES if kind.dtype == types.float64 else _LONGS
    return builder.bitcast(builder.gep(data, [at], inbounds=True), vector.as_pointer())


def _is_row(kind: Any, dtype: Any) -> bool:
    return isinstance(kind, types.Array) and kind.ndim == 1 and kind.layout == "C" and kind.dtype == dtype


def _is_row_of_lanes(kind: Any) -> bool:
    return isinstance(kind, LaneArrayType) and len(kind.shape) == 1


@intrinsic  # type: ignore[untyped-decorator]
def block(context: Any, array: Any) -> Any:
    """How many joints a block of an array holds: eight, or one of eight arms."""
    width = 1 if _is_row_of_lanes(array) else WIDTH
    return types.intp(array), lambda _context, _builder, _signature, _arguments: LONG(width)


@intrinsic  # type: ignore[untyped-decorator]
def within(context: Any, array: Any, count: Any, at: Any) -> Any:
    """Which joints of a block of an array are below a count; a block of lanes is one joint, and is."""
    if _is_row_of_lanes(array):
        return types.boolean(array, types.int64, types.int64), lambda *_: ir.IntType(1)(1)
    return MaskType(WIDTH)(array, types.int64, types.int64), lambda context, builder, _sig, given: _below(
        builder, *given[1:]
    )


@intrinsic  # type: ignore[untyped-decorator]
def total(context: Any, array: Any, lanes: Any) -> Any:
    """The sum over the joints of sums over blocks of an array: a number, of lanes one an arm."""
    if _is_row_of_lanes(array):
        return lanes(array, lanes), lambda _context, _builder, _signature, arguments: arguments[1]

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return _folded(builder, arguments[1], builder.fadd)

    return types.float64(array, lanes), code


@intrinsic  # type: ignore[untyped-decorator]
def several(context: Any, array: Any, at: Any) -> Any:
    """Eight numbers of a one-dimensional array of float64, from ``at`` on; of lanes, those at ``at``."""
    if _is_row_of_lanes(array):
        return LanesType(array.width)(array, types.intp), load_lanes
    if not _is_row(array, types.float64):
        return None

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return builder.load(_place(context, builder, sig.args[0], *arguments), align=8)

    return LanesType(WIDTH)(array, types.intp), code


@intrinsic  # type: ignore[untyped-decorator]
def put(context: Any, array: Any, at: Any, lanes: Any) -> Any:
    """Write eight numbers into a one-dimensional array of float64, from ``at`` on; of lanes, at ``at``."""
    if _is_row_of_lanes(array):
        return types.none(array, types.intp, LanesType(array.width)), store_lanes
    if not _is_row(array, types.float64):
        return None

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        *where, value = arguments
        builder.store(value, _place(context, builder, sig.args[0], *where), align=8)
        return context.get_dummy_value()

    return types.none(array, types.intp, LanesType(WIDTH)), code


@intrinsic  # type: ignore[untyped-decorator]
def is_set(context: Any, array: Any, at: Any) -> Any:
    """Which of eight whole numbers of a one-dimensional array are not 0."""
    if not _is_row(array, types.int64):
        return None

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        value = builder.load(_place(context, builder, sig.args[0], *arguments), align=8)
        return builder.icmp_signed("!=", value, ir.Constant(_LONGS, [0] * WIDTH))

    return MaskType(WIDTH)(array, types.intp), code


@intrinsic  # type: ignore[untyped-decorator]
def put_either(context: Any, array: Any, at: Any, condition: Any, one: Any, other: Any) -> Any:
    """Write eight whole numbers: ``one`` where a condition holds, elsewhere ``other``."""
    if not _is_row(array, types.int64):
        return None

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        array, at, condition, *values = arguments
        first, second = (_everywhere(builder, value, _LONGS) for value in values)
        chosen = builder.select(condition, first, second)
        builder.store(chosen, _place(context, builder, sig.args[0], array, at), align=8)
        return context.get_dummy_value()

    return types.none(array, types.intp, MaskType(WIDTH), types.int64, types.int64), code


def _everywhere(builder: Any, value: Any, kind: Any) -> Any:
    first = builder.insert_element(ir.Constant(kind, ir.Undefined), value, ir.IntType(32)(0))
    order = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, ir.Constant(kind, ir.Undefined), order)


@intrinsic  # type: ignore[untyped-decorator]
def below(context: Any, count: Any, at: Any) -> Any:
    """Which of the indices at .. at + 7 are below a count."""

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return _below(builder, *arguments)

    return MaskType(WIDTH)(types.int64, types.int64), code


def _numbered(builder: Any, at: Any) -> Any:
    first = _everywhere(builder, builder.sitofp(at, DOUBLE), _DOUBLES)
    return builder.fadd(first, ir.Constant(_DOUBLES, [DOUBLE(float(k)) for k in range(WIDTH)]))


@intrinsic  # type: ignore[untyped-decorator]
def numbers(context: Any, array: Any, at: Any) -> Any:
    """The indices of the joints of a block of an array."""
    if _is_row_of_lanes(array):
        return types.float64(array, types.int64), lambda _context, builder, _signature, given: builder.sitofp(
            given[1], DOUBLE
        )
    return LanesType(WIDTH)(array, types.int64), lambda _context, builder, _signature, given: _numbered(
        builder, given[1]
    )


def _below(builder: Any, count: Any, at: Any) -> Any:
    left = _everywhere(builder, builder.sub(count, at), _LONGS)
    return builder.icmp_signed("<", ir.Constant(_LONGS, _PLACES), left)


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
