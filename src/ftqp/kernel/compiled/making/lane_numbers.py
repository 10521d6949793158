"""Eight numbers in a vector register as a type of numba's: the same formula serves one joint and eight.

``Lanes`` are float64, one a joint, and a ``Mask`` is what a comparison of two gives.
"""

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, lower_cast, models, register_model

WIDTH = 8
"""Joints in a register: one of AVX-512; of smaller ones the compiler takes several."""

DOUBLE, LONG, BIT = ir.DoubleType(), ir.IntType(64), ir.IntType(1)
DOUBLES, LONGS, BITS = (ir.VectorType(kind, WIDTH) for kind in (DOUBLE, LONG, BIT))
NUMBERS = types.Float | types.Integer


class LanesType(types.Type):  # type: ignore[misc]
    """Eight float64."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")

    def can_convert_from(self, context: Any, other: Any) -> Any:
        """A number is the same in every lane."""
        return Conversion.safe if isinstance(other, NUMBERS) else None

    def unify(self, context: Any, other: Any) -> Any:
        """A variable that is a number here and lanes there is lanes."""
        return self if isinstance(other, NUMBERS) else None


class MaskType(types.Type):  # type: ignore[misc]
    """Eight truth values."""

    def __init__(self) -> None:
        super().__init__(name="Mask")


LANES, MASK = LanesType(), MaskType()


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, DOUBLES)


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, BITS)


def everywhere(builder: Any, value: Any, kind: Any) -> Any:
    """The same number in every lane."""
    first = builder.insert_element(ir.Constant(kind, ir.Undefined), value, ir.IntType(32)(0))
    order = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, ir.Constant(kind, ir.Undefined), order)


def _cast(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    return everywhere(builder, context.cast(builder, value, given, types.float64), DOUBLES)


lower_cast(types.Float, LanesType)(_cast)
lower_cast(types.Integer, LanesType)(_cast)


def _has_lanes(kinds: Any) -> bool:
    """Whether there are lanes among the types, and else only numbers."""
    return any(kind == LANES for kind in kinds) and all(
        kind == LANES or isinstance(kind, NUMBERS) for kind in kinds
    )


def _rule(result: Any) -> type:
    """A typing rule: of lanes, or lanes and numbers, comes ``result``."""

    class Rule(AbstractTemplate):  # type: ignore[misc]
        def generic(self, arguments: Any, _keywords: Any) -> Any:
            return signature(result, *(LANES for _ in arguments)) if _has_lanes(arguments) else None

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

    _register(_operator, 2, _rule(LANES), _arithmetic)
    _register(_in_place, 2, _rule(LANES), _arithmetic)

for _operator, _sign in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">=")):

    def _comparison(builder: Any, a: Any, b: Any, sign: str = _sign) -> Any:
        return builder.fcmp_ordered(sign, a, b)

    _register(_operator, 2, _rule(MASK), _comparison)

_register(operator.neg, 1, _rule(LANES), lambda builder, a: builder.fneg(a))


class _OfMasks(AbstractTemplate):  # type: ignore[misc]
    def generic(self, arguments: Any, _keywords: Any) -> Any:
        if arguments and all(kind == MASK for kind in arguments):
            return signature(MASK, *arguments)
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
    *, sqrt: Any, floor: Any, mul_add: Any, larger: Any, smaller: Any, select: Any, any_of: Any
) -> None:
    """Make elementary functions known to compiled code, for numbers and for lanes."""

    def root(builder: Any, a: Any) -> Any:
        return _llvm(builder, "llvm.sqrt", a)

    def down(builder: Any, a: Any) -> Any:
        return _llvm(builder, "llvm.floor", a)

    def fused(builder: Any, a: Any, b: Any, c: Any) -> Any:
        return _llvm(builder, "llvm.fmuladd", a, b, c)

    def most(builder: Any, a: Any, b: Any) -> Any:
        return builder.select(builder.fcmp_ordered(">", b, a), b, a)

    def least(builder: Any, a: Any, b: Any) -> Any:
        return builder.select(builder.fcmp_ordered("<", b, a), b, a)

    class OfNumbers(AbstractTemplate):  # type: ignore[misc]
        def generic(self, arguments: Any, _keywords: Any) -> Any:
            kind = LANES if _has_lanes(arguments) else types.float64
            if kind == LANES or all(isinstance(one, NUMBERS) for one in arguments):
                return signature(kind, *(kind for _ in arguments))
            return None

    for function, count, code in (
        (sqrt, 1, root), (floor, 1, down), (mul_add, 3, fused), (larger, 2, most), (smaller, 2, least),
    ):  # fmt: skip
        infer_global(function)(type(f"Rule_{function.__name__}", (OfNumbers,), {}))
        for kind in (LanesType, types.Float):
            lower_builtin(function, *(kind,) * count)(
                lambda context, builder, sig, values, code=code: code(builder, *values)
            )

    class Choice(AbstractTemplate):  # type: ignore[misc]
        def generic(self, arguments: Any, _keywords: Any) -> Any:
            condition, *values = arguments
            if not isinstance(condition, MaskType | types.Boolean):
                return None
            kind = LANES if condition == MASK or _has_lanes(values) else types.float64
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
            "!=", builder.zext(builder.bitcast(values[0], ir.IntType(WIDTH)), LONG), LONG(0)
        )
    )


class _Absolute(AbstractTemplate):  # type: ignore[misc]
    def generic(self, arguments: Any, _keywords: Any) -> Any:
        return signature(LANES, LANES) if tuple(arguments) == (LANES,) else None


infer_global(abs)(_Absolute)
lower_builtin(abs, LanesType)(lambda context, builder, sig, values: _llvm(builder, "llvm.fabs", values[0]))
