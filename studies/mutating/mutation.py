"""Mutants of a module: which there are, and how one takes the module's place in a process that runs."""

import ast
import inspect
import random
import sys
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, final

_REPLACED = {
    "Binary": "Add_Sub Sub_Add Mul_Div Div_Mul BitOr_BitAnd BitAnd_BitOr",
    "Comparison": "Lt_LtE LtE_Lt Gt_GtE GtE_Gt Lt_GtE LtE_Gt Gt_LtE GtE_Lt Eq_NotEq NotEq_Eq",
    "Unary": "USub_UAdd Delete_Not",
}
OPERATORS = (
    *(f"Replace{kind}Operator_{pair}" for kind, pairs in _REPLACED.items() for pair in pairs.split()),
    "AddNot", "ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ReplaceAndWithOr", "ReplaceOrWithAnd",
    "ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "NumberReplacer", "ZeroIterationForLoop",
)  # fmt: skip
"""Operators of cosmic-ray that keep the types: those that do not (``x << y`` of floats) die of themselves."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Mutant:
    """One change of one place.

    Attributes:
        module: The module's name.
        operator: The operator of cosmic-ray that made it.
        line: Its line, from 1.
        before: That line.
        after: What it became.
        source: The whole module.
    """

    module: str
    operator: str
    line: int
    before: str
    after: str
    source: str


def file_of(module: str) -> Path:
    """The file of a module."""
    found = sys.modules.get(module) or import_module(module)
    return Path(inspect.getfile(found))


@cache
def mutants(module: str) -> tuple[Mutant, ...]:
    """All mutants of a module whose code differs from it, each once, in the order of its lines."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    source = file_of(module).read_text(encoding="utf-8")
    seen = {ast.dump(ast.parse(source))}
    found: list[Mutant] = []
    for name in OPERATORS:
        operator, occurrence = get_operator(f"core/{name}")(), 0
        while (text := mutate_code(source, operator, occurrence)) is not None:
            occurrence += 1
            code = ast.dump(ast.parse(text))
            if code in seen:
                continue
            seen.add(code)
            lines = list(zip(source.splitlines(), text.splitlines(), strict=False))
            line = next(k for k, (old, new) in enumerate(lines) if old != new)
            found.append(
                Mutant(
                    module=module, operator=name, line=line + 1, source=text,
                    before=lines[line][0].strip(), after=lines[line][1].strip(),
                )
            )  # fmt: skip
    return tuple(sorted(found, key=lambda mutant: (mutant.line, mutant.operator, mutant.after)))


def sampled(module: str, count: int, seed: int) -> list[Mutant]:
    """So many mutants of a module, drawn at random without replacement, or all of them."""
    every = mutants(module)
    if count >= len(every):
        return list(every)
    chosen = random.Random(f"{seed} {module}").sample(range(len(every)), count)
    return [every[k] for k in sorted(chosen)]


def planted(mutant: Mutant) -> None:
    """Put a mutant into its module: functions get other code, constants other values wherever they went."""
    module = import_module(mutant.module)
    fresh = ModuleType(mutant.module)
    fresh.__dict__.update(__file__=module.__file__, __package__=module.__package__)
    sys.modules[mutant.module] = fresh  # where dataclasses look up names
    try:
        exec(compile(mutant.source, str(module.__file__), "exec"), fresh.__dict__)
    finally:
        sys.modules[mutant.module] = module
    for name, thing in list(vars(module).items()):
        if name.startswith("__") or name not in vars(fresh):
            continue
        other = vars(fresh)[name]
        if isinstance(thing, FunctionType) and thing.__module__ == mutant.module:
            _take_over(thing, other)
        elif inspect.isclass(thing) and thing.__module__ == mutant.module:
            _take_over_class(thing, other)
        elif isinstance(thing, int | float | str | tuple) and thing != other:
            for user in [m for key, m in sys.modules.items() if key.startswith("ftqp.")]:
                if vars(user).get(name) is thing:
                    setattr(user, name, other)


def _take_over(thing: Any, other: Any) -> None:
    thing.__code__, thing.__defaults__ = other.__code__, other.__defaults__
    thing.__kwdefaults__ = other.__kwdefaults__


def _take_over_class(thing: type, other: type) -> None:
    for name, value in list(vars(thing).items()):
        new = vars(other).get(name)
        if isinstance(value, property) and isinstance(new, property):
            _take_over(value.fget, new.fget)
        elif isinstance(value, FunctionType) and isinstance(new, FunctionType):
            if value.__code__.co_freevars == new.__code__.co_freevars:
                _take_over(value, new)
            else:
                type.__setattr__(thing, name, new)
        elif not name.startswith("__") and isinstance(value, int | float | str) and new != value:
            setattr(thing, name, new)
    if "__dataclass_fields__" in vars(thing):
        type.__setattr__(thing, "__dataclass_fields__", vars(other)["__dataclass_fields__"])
        for name in ("__setattr__", "__delattr__"):  # of a frozen one
            if name in vars(thing) and name not in vars(other):
                type.__delattr__(thing, name)
