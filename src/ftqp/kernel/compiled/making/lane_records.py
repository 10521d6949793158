"""Records of several arms side by side, as types of numba's.

A ``LaneRecord`` looks like the record of a planner, ``K.room.field[i]``, but the fields that differ from arm
to arm hold ``Lanes``; every other field is that of a plain record beside it, which all arms share.
"""

import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_untracked
from numba.core.typing.templates import (
    AbstractTemplate,
    AttributeTemplate,
    infer_getattr,
    infer_global,
    signature,
)
from numba.extending import (
    intrinsic,
    lower_builtin,
    lower_getattr_generic,
    lower_setattr_generic,
    models,
    register_model,
)

from ftqp.kernel.compiled.making.lane_numbers import BIT, DOUBLE, LONG, LanesType, MaskType, as_bits


class LaneArrayType(types.Type):  # type: ignore[misc]
    """An array of ``Lanes`` of a fixed shape."""

    def __init__(self, width: int, shape: tuple[int, ...]) -> None:
        super().__init__(name=f"LaneArray({width}, {shape})")
        self.width, self.shape = width, shape


class LaneRoomType(types.Type):  # type: ignore[misc]
    """A room of which some fields hold lanes, and the others are those of the shared record."""

    def __init__(self, width: int, room: str, dtype: Any, shared: Any) -> None:
        super().__init__(name=f"LaneRoom({width}, {room}, {dtype}, {shared})")
        self.width, self.dtype, self.shared = width, dtype, shared


class LaneRecordType(types.Type):  # type: ignore[misc]
    """A record of which some rooms are lane rooms, and the others those of the shared record."""

    def __init__(self, width: int, dtype: Any, shared: Any) -> None:
        super().__init__(name=f"LaneRecord({width}, {dtype}, {shared})")
        self.width, self.dtype, self.shared = width, dtype, shared


@register_model(LaneArrayType)
class _LaneArrayModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, DOUBLE.as_pointer())


class _LanesAndShared(models.StructModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [("lanes", types.CPointer(types.float64)), ("shared", kind.shared)])


register_model(LaneRoomType)(_LanesAndShared)
register_model(LaneRecordType)(_LanesAndShared)


# Arrays of lanes


def _places(kind: Any) -> tuple[Any, ...] | None:
    """The types of the indices of a getitem, one an axis."""
    if isinstance(kind, types.Integer):
        return (kind,)
    if isinstance(kind, types.BaseTuple) and all(isinstance(one, types.Integer) for one in kind.types):
        return tuple(kind.types)
    return None


@infer_global(operator.getitem)
class _GetItem(AbstractTemplate):  # type: ignore[misc]
    def generic(self, arguments: Any, _keywords: Any) -> Any:
        array, index = arguments
        if not isinstance(array, LaneArrayType):
            return None
        places = _places(index)
        if places is None or len(places) > len(array.shape):
            return None
        rest = array.shape[len(places) :]
        return signature(LaneArrayType(array.width, rest) if rest else LanesType(array.width), array, index)


@infer_global(operator.setitem)
class _SetItem(AbstractTemplate):  # type: ignore[misc]
    def generic(self, arguments: Any, _keywords: Any) -> Any:
        array, index, value = arguments
        if not isinstance(array, LaneArrayType):
            return None
        places = _places(index)
        if places is None or len(places) != len(array.shape):
            return None
        if not isinstance(value, LanesType | types.Float | types.Integer):
            return None
        return signature(types.none, array, index, LanesType(array.width))


def _address(context: Any, builder: Any, array: Any, index: Any, pointer: Any, value: Any) -> Any:
    """The place of element ``value`` (one index an axis, or the first few) of an array at ``pointer``."""
    places = _places(index) or ()
    numbers = cgutils.unpack_tuple(builder, value) if isinstance(index, types.BaseTuple) else [value]
    total = LONG(0)
    for axis, (kind, number) in enumerate(zip(places, numbers, strict=True)):
        stride = array.width * int(np.prod(array.shape[axis + 1 :], dtype=int))
        at = context.cast(builder, number, kind, types.intp)
        total = builder.add(total, builder.mul(at, LONG(stride)))
    return builder.gep(pointer, [total], inbounds=True)


def _load(builder: Any, place: Any, width: int) -> Any:
    place = builder.bitcast(place, ir.VectorType(DOUBLE, width).as_pointer())
    return builder.load(place, align=8 * width)


def _store(builder: Any, value: Any, place: Any, width: int) -> None:
    place = builder.bitcast(place, ir.VectorType(DOUBLE, width).as_pointer())
    builder.store(value, place, align=8 * width)


def _get_item(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    array, index = sig.args
    place = _address(context, builder, array, index, *values)
    if isinstance(sig.return_type, LaneArrayType):
        return place
    return _load(builder, place, array.width)


def _set_item(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    array, index, _ = sig.args
    place = _address(context, builder, array, index, values[0], values[1])
    _store(builder, values[2], place, array.width)
    return context.get_dummy_value()


def load_lanes(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    """Code of an intrinsic of an array of lanes and an index: the lanes there."""
    return _load(builder, _address(context, builder, *sig.args[:2], *values[:2]), sig.args[0].width)


def store_lanes(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    """Code of an intrinsic of an array of lanes, an index and lanes, which go there."""
    _store(builder, values[2], _address(context, builder, *sig.args[:2], *values[:2]), sig.args[0].width)
    return context.get_dummy_value()


for _index in (types.Integer, types.BaseTuple):
    lower_builtin(operator.getitem, LaneArrayType, _index)(_get_item)
    lower_builtin(operator.setitem, LaneArrayType, _index, LanesType)(_set_item)


# Rooms and records


def _field(dtype: Any, name: str) -> tuple[int, tuple[int, ...]] | None:
    """Where a field of lanes begins, in bytes, and its shape without the lanes; None where there is none."""
    if name not in (dtype.names or ()):
        return None
    kind, offset = dtype.fields[name][:2]
    return offset, tuple(kind.shape[:-1])


class _OfRoom(AttributeTemplate):  # type: ignore[misc]
    key = LaneRoomType

    def generic_resolve(self, room: Any, name: str) -> Any:
        found = _field(room.dtype, name)
        if found is None:
            return self.context.resolve_getattr(room.shared, name)
        return LaneArrayType(room.width, found[1]) if found[1] else LanesType(room.width)


class _OfRecord(AttributeTemplate):  # type: ignore[misc]
    key = LaneRecordType

    def generic_resolve(self, record: Any, name: str) -> Any:
        return _room(self.context, record, name)


def _room(context: Any, record: Any, name: str) -> Any:
    """The type of a room: with lanes, or that of the shared record."""
    shared = context.resolve_getattr(record.shared, name) if name in record.shared.fields else types.none
    if name not in record.dtype.names:
        return shared
    return LaneRoomType(record.width, name, record.dtype.fields[name][0], shared)


infer_getattr(_OfRoom)
infer_getattr(_OfRecord)


def _parts(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    return cgutils.create_struct_proxy(kind)(context, builder, value=value)


def _shared_attribute(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    get = context.get_getattr(kind, name)
    return get(context, builder, kind, value, name)


@lower_getattr_generic(LaneRoomType)  # type: ignore[untyped-decorator]
def _room_attribute(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    parts = _parts(context, builder, kind, value)
    found = _field(kind.dtype, name)
    if found is None:
        return _shared_attribute(context, builder, kind.shared, parts.shared, name)
    place = builder.gep(parts.lanes, [LONG(found[0] // 8)], inbounds=True)
    return place if found[1] else _load(builder, place, kind.width)


@lower_getattr_generic(LaneRecordType)  # type: ignore[untyped-decorator]
def _record_attribute(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    parts = _parts(context, builder, kind, value)
    room = _room(context.typing_context, kind, name)
    if not isinstance(room, LaneRoomType):
        return _shared_attribute(context, builder, kind.shared, parts.shared, name)
    offset = kind.dtype.fields[name][1]
    made = cgutils.create_struct_proxy(room)(context, builder)
    made.lanes = builder.gep(parts.lanes, [LONG(offset // 8)], inbounds=True)
    if room.shared != types.none:
        made.shared = _shared_attribute(context, builder, kind.shared, parts.shared, name)
    return impl_ret_untracked(context, builder, room, made._getvalue())


@lower_setattr_generic(LaneRoomType)  # type: ignore[untyped-decorator]
def _set_room_attribute(context: Any, builder: Any, sig: Any, values: Any, name: str) -> None:
    kind, given = sig.args
    parts = _parts(context, builder, kind, values[0])
    found = _field(kind.dtype, name)
    if found is None:
        wanted = context.typing_context.resolve_getattr(kind.shared, name)
        put = context.get_setattr(name, signature(types.none, kind.shared, wanted))
        put(builder, (parts.shared, context.cast(builder, values[1], given, wanted)))
        return
    value = context.cast(builder, values[1], given, LanesType(kind.width))
    place = builder.gep(parts.lanes, [LONG(found[0] // 8)], inbounds=True)
    _store(builder, value, place, kind.width)


def lane_record(width: int, dtype: Any) -> Any:
    """A function of compiled code: the lane record at an address beside a shared record.

    Args:
        width: How many lanes.
        dtype: Rooms of fields whose last axis is the lane, each beginning at a multiple of 8 ``width`` bytes.
    """

    @intrinsic  # type: ignore[untyped-decorator]
    def at(context: Any, address: Any, shared: Any) -> Any:
        kind = LaneRecordType(width, dtype, shared)

        def code(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            made = cgutils.create_struct_proxy(kind)(context, builder)
            made.lanes = builder.inttoptr(arguments[0], DOUBLE.as_pointer())
            made.shared = arguments[1]
            return made._getvalue()

        return kind(types.int64, shared), code

    return at


@intrinsic  # type: ignore[untyped-decorator]
def bits(context: Any, mask: Any) -> Any:
    """The truth values of a mask as the bits of a whole number, the first lane the lowest."""

    def code(_context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return as_bits(builder, arguments[0], sig.args[0].width)

    return types.int64(mask), code


@intrinsic  # type: ignore[untyped-decorator]
def lane_of(context: Any, array: Any, index: Any, lane: Any) -> Any:
    """Element ``index`` of a one-dimensional array of lanes, in one lane."""

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        place = _address(context, builder, sig.args[0], types.intp, arguments[0], arguments[1])
        return builder.load(builder.gep(place, [arguments[2]], inbounds=True))

    return types.float64(array, types.intp, types.intp), code


@intrinsic  # type: ignore[untyped-decorator]
def put_lane(context: Any, array: Any, index: Any, lane: Any, value: Any) -> Any:
    """Write element ``index`` of a one-dimensional array of lanes, in one lane."""

    def code(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        place = _address(context, builder, sig.args[0], types.intp, arguments[0], arguments[1])
        builder.store(arguments[3], builder.gep(place, [arguments[2]], inbounds=True))
        return context.get_dummy_value()

    return types.none(array, types.intp, types.intp, types.float64), code


@intrinsic  # type: ignore[untyped-decorator]
def as_mask(context: Any, record: Any, number: Any) -> Any:
    """The mask for the lanes of a record whose truth values are the lowest bits of a whole number."""
    kind = MaskType(record.width)

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        number = builder.trunc(arguments[1], ir.IntType(kind.width))
        return builder.bitcast(number, ir.VectorType(BIT, kind.width))

    return kind(record, types.int64), code
