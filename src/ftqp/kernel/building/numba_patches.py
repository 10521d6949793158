"""Shortcuts for numba, whose typing and lowering of formulas is three quarters of a build.

All give what numba's own functions give: the type of an operation is asked for once for the same arguments,
the walk through an instruction looks at what can hold a variable only, the kernel's record, whose long name
every pass over every function asks for, makes it once, and of the nine times that a function is put in order,
lifetimes of its variables are sought only the last time, when they are needed. Without them a build from
nothing takes 167 s of CPU (beside others on two cores), more than the 150 s that it may take.
"""

from typing import Any

from numba.core import ir, transforms
from numba.core.postproc import PostProcessor, VariableLifetime
from numba.core.types import Record
from numba.core.types.functions import BaseFunction

_call_type = BaseFunction.get_call_type
_variables_in = ir.Inst._rec_list_vars
_name_of = Record.__repr__
_put_in_order = PostProcessor.run
_KNOWN: dict[tuple[Any, Any], Any] = {}
_NAMES: dict[int, tuple[Any, str]] = {}
_WITHOUT_VARIABLES = frozenset({ir.Loc, str, int, float, bool, type(None)})


def _call_type_once(self: Any, context: Any, args: Any, kws: Any) -> Any:
    if kws:
        return _call_type(self, context, args, kws)
    found = _KNOWN.get((self, args))
    if found is None:
        found = _KNOWN[self, args] = _call_type(self, context, args, kws)
    return found


def _variables_within(self: Any, value: Any) -> Any:
    found: list[Any] = []
    _gather(self, value, found)
    return found


def _gather(self: Any, value: Any, found: list[Any]) -> None:
    kind = type(value)
    if kind is ir.Var:
        found.append(value)
    elif kind is dict:
        for one in value.values():
            _gather(self, one, found)
    elif kind is tuple or kind is list:
        for one in value:
            _gather(self, one, found)
    elif kind is ir.Expr:
        _gather(self, value._kws, found)
    elif kind not in _WITHOUT_VARIABLES:
        found += _variables_in(self, value)


def _named_once(self: Any) -> str:
    found = _NAMES.get(id(self))
    if found is None or found[0] is not self:
        found = _NAMES[id(self)] = self, _name_of(self)
    return found[1]


def _order_only(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    if emit_dels or self.func_ir.is_generator:
        _put_in_order(self, emit_dels, extend_lifetimes)
        return
    code = self.func_ir
    code.blocks = transforms.canonicalize_cfg(code.blocks)
    code.variable_lifetime, code.generator_info = VariableLifetime(code.blocks), None


def patch_numba() -> None:
    """Take the shortcuts from now on."""
    if BaseFunction.get_call_type is _call_type_once:
        return
    for owner, name, shortcut in (
        (BaseFunction, "get_call_type", _call_type_once),
        (ir.Inst, "_rec_list_vars", _variables_within),
        (Record, "__repr__", _named_once),
        (PostProcessor, "run", _order_only),
    ):
        setattr(owner, name, shortcut)
