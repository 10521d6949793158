"""Numbers of several arms side by side as a type of numba's: the same source serves one arm and many.

``Lanes`` is a vector register of float64, one lane an arm, ``Mask`` what a comparison of two gives.
"""

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, lower_cast, models, register_model

DOUBLE, LONG, BIT = ir.DoubleType(), ir.IntType(64), ir.IntType(1)


class LanesType(types.Type):  # type: ignore[misc]
    """``width`` float64 side by side."""

    def __init__(self, width: int) -> None:
        super().__init__(name=f"Lanes({width})")
        self.width = width

    def can_convert_from(self, context: Any, other: Any) -> Any:
        """A number is the same in every lane."""
        return Conversion.safe if isinstance(other, types.Float | types.Integer) else None

    def unify(self, context: Any, other: Any) -> Any:
        """A variable that is a number here and lanes there is lanes."""
        return self if isinstance(other, types.Float | types.Integer) else None


class MaskType(types.Type):  # type: ignore[misc]
    """``width`` truth values side by side."""

    def __init__(self, width: int) -> None:
        super().__init__(name=f"Mask({width})")
        self.width = width


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, ir.VectorType(DOUBLE, kind.width))


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, ir.VectorType(BIT, kind.width))


def _same_in_every_lane(builder: Any, value: Any, width: int) -> Any:
    kind = ir.VectorType(DOUBLE, width)
    first = builder.insert_element(ir.Constant(kind, ir.Undefined), value, ir.IntType(32)(0))
    order = ir.Constant(ir.VectorType(ir.IntType(32), width), [0] * width)
    return builder.shuffle_vector(first, ir.Constant(kind, ir.Undefined), order)


def _cast(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    number = context.cast(builder, value, given, types.float64)
    return _same_in_every_lane(builder, number, wanted.width)


lower_cast(types.Float, LanesType)(_cast)
lower_cast(types.Integer, LanesType)(_cast)


def _width_of(arguments: Any) -> int:
    """The width of the lanes among the arguments; 0 when there is none, or something that is no number."""
    width = 0
    for kind in arguments:
        if isinstance(kind, LanesType):
            width = kind.width
        elif not isinstance(kind, types.Float | types.Integer):
            return 0
    return width


def _numeric(result: type[LanesType] | type[MaskType]) -> type:
    """A typing rule: of lanes, or lanes and numbers, comes ``result``."""

    class Rule(AbstractTemplate):  # type: ignore[misc]
        def generic(self, arguments: Any, _keywords: Any) -> Any:
            width = _width_of(arguments)
            if not width:
                return None
            return signature(result(width), *(LanesType(width) for _ in arguments))

    return Rule


def _register(function: Any, count: int, rule: type, code: Any) -> None:
    infer_global(function)(type(f"Rule_{function.__name__}", (rule,), {}))
    lower_builtin(function, *(LanesType,) * count)(
        lambda context, builder, sig, values: code(builder, *values)
    )


for _operator, _in_place, _instruction in (
    (operator.add, operator.iadd, "fadd"),
    (operator.sub, operator.isub, "fsub"),
    (operator.mul, operator.imul, "fmul"),
    (operator.truediv, operator.itruediv, "fdiv"),
):

    def _arithmetic(builder: Any, a: Any, b: Any, instruction: str = _instruction) -> Any:
        return getattr(builder, instruction)(a, b)

    _register(_operator, 2, _numeric(LanesType), _arithmetic)
    _register(_in_place, 2, _numeric(LanesType), _arithmetic)

for _operator, _sign in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">=")):

    def _comparison(builder: Any, a: Any, b: Any, sign: str = _sign) -> Any:
        return builder.fcmp_ordered(sign, a, b)

    _register(_operator, 2, _numeric(MaskType), _comparison)


_register(operator.neg, 1, _numeric(LanesType), lambda builder, a: builder.fneg(a))


class _OfMasks(AbstractTemplate):  # type: ignore[misc]
    def generic(self, arguments: Any, _keywords: Any) -> Any:
        if arguments and all(isinstance(kind, MaskType) for kind in arguments):
            return signature(arguments[0], *arguments)
        return None


for _operator, _instruction in ((operator.and_, "and_"), (operator.or_, "or_")):
    infer_global(_operator)(type("OfMasks", (_OfMasks,), {}))
    lower_builtin(_operator, MaskType, MaskType)(
        lambda context, builder, sig, values, name=_instruction: getattr(builder, name)(*values)
    )
infer_global(operator.invert)(type("NotMask", (_OfMasks,), {}))
lower_builtin(operator.invert, MaskType)(lambda context, builder, sig, values: builder.not_(values[0]))


def _llvm(builder: Any, name: str, *values: Any) -> Any:
    kind = values[0].type
    suffix = f"v{kind.count}f64" if isinstance(kind, ir.VectorType) else "f64"
    function = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(kind, [value.type for value in values]), f"{name}.{suffix}"
    )
    return builder.call(function, values)


def register_elementary(
    *, sqrt: Any, floor: Any, larger: Any, smaller: Any, select: Any, any_of: Any
) -> None:
    """Make elementary functions known to compiled code, for numbers and for lanes.

    Args:
        sqrt: sqrt x.
        floor: The largest whole number <= x, as a float.
        larger: The larger of two.
        smaller: The smaller of two.
        select: ``a`` where a condition holds, else ``b``.
        any_of: Whether a condition holds in any lane.
    """

    def root(builder: Any, a: Any) -> Any:
        return _llvm(builder, "llvm.sqrt", a)

    def down(builder: Any, a: Any) -> Any:
        return _llvm(builder, "llvm.floor", a)

    def most(builder: Any, a: Any, b: Any) -> Any:
        return builder.select(builder.fcmp_ordered(">", b, a), b, a)

    def least(builder: Any, a: Any, b: Any) -> Any:
        return builder.select(builder.fcmp_ordered("<", b, a), b, a)

    class OfNumbers(AbstractTemplate):  # type: ignore[misc]
        def generic(self, arguments: Any, _keywords: Any) -> Any:
            if all(isinstance(kind, types.Float | types.Integer) for kind in arguments):
                return signature(types.float64, *(types.float64 for _ in arguments))
            width = _width_of(arguments)
            return (width and signature(LanesType(width), *(LanesType(width) for _ in arguments))) or None

    for function, count, code in ((sqrt, 1, root), (floor, 1, down), (larger, 2, most), (smaller, 2, least)):
        infer_global(function)(type(f"Rule_{function.__name__}", (OfNumbers,), {}))
        for kind in (LanesType, types.Float):
            lower_builtin(function, *(kind,) * count)(
                lambda context, builder, sig, values, code=code: code(builder, *values)
            )

    class Choice(AbstractTemplate):  # type: ignore[misc]
        def generic(self, arguments: Any, _keywords: Any) -> Any:
            condition, *values = arguments
            if isinstance(condition, MaskType):
                kind = LanesType(condition.width)
                return signature(kind, condition, kind, kind)
            if not isinstance(condition, types.Boolean):
                return None
            kind = (
                LanesType(_width_of(values))
                if any(isinstance(v, LanesType) for v in values)
                else types.float64
            )
            return signature(kind, condition, kind, kind)

    infer_global(select)(Choice)
    for condition, kind in (
        (MaskType, LanesType),
        (types.Boolean, LanesType),
        (types.Boolean, types.Float),
    ):
        lower_builtin(select, condition, kind, kind)(
            lambda context, builder, sig, values: builder.select(*values)
        )

    class Any_(AbstractTemplate):  # type: ignore[misc]
        def generic(self, arguments: Any, _keywords: Any) -> Any:
            if isinstance(arguments[0], MaskType | types.Boolean):
                return signature(types.boolean, arguments[0])
            return None

    infer_global(any_of)(Any_)
    lower_builtin(any_of, types.Boolean)(lambda context, builder, sig, values: values[0])
    lower_builtin(any_of, MaskType)(
        lambda context, builder, sig, values: builder.icmp_unsigned(
            "!=", as_bits(builder, values[0], sig.args[0].width), LONG(0)
        )
    )


def as_bits(builder: Any, mask: Any, width: int) -> Any:
    """The truth values of a mask as the lowest bits of a 64-bit integer.

    Args:
        builder: Where code goes.
        mask: The mask.
        width: How many lanes it has.
    """
    return builder.zext(builder.bitcast(mask, ir.IntType(width)), LONG)


class _Absolute(AbstractTemplate):  # type: ignore[misc]
    def generic(self, arguments: Any, _keywords: Any) -> Any:
        if len(arguments) == 1 and isinstance(arguments[0], LanesType):
            return signature(arguments[0], arguments[0])
        return None


infer_global(abs)(_Absolute)
lower_builtin(abs, LanesType)(lambda context, builder, sig, values: _llvm(builder, "llvm.fabs", values[0]))
