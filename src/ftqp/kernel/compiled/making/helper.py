"""Helpers of the kernel: linked into the units that call them, optimised there once and nowhere else.

numba compiles every function that another one calls for itself first: full optimisation, machine code,
verification. Here a helper stops at its intermediate code, which the unit that calls it links and optimises
as one piece. A helper that lies apart is a unit of its own: its callers know its name and types only, so that
it is compiled once for all of them, beside them, and a change in it compiles none of them anew.

No formula counts indices from an array's end, so that none is looked at for its sign.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import llvmlite.binding as llvm
import numba
from numba import types
from numba.core import compiler, typing
from numba.core import dispatcher as numba_dispatcher
from numba.core.codegen import JITCodeLibrary
from numba.core.funcdesc import FunctionDescriptor
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.runtime import rtsys
from numba.np import arrayobj

F = TypeVar("F", bound=Callable[..., Any])

FAST = {"nsz", "contract", "arcp", "reassoc", "afn"}
"""LLVM's fast-math flags that the kernel allows; never nnan or ninf, as an infinite bound is no limit."""

APART = "ftqp_apart_"
"""How the symbol of a helper that lies apart begins."""

_RESULTS = {int: types.int64, float: types.float64, bool: types.boolean, None: types.none}
"""What a helper that lies apart may return, by its annotation."""


_PLAIN = (types.Record, types.Array, types.Number, types.Boolean)
"""What a helper that lies apart may be given; one that is given lanes becomes part of its caller."""


def _index(context: Any, builder: Any, kind: Any, value: Any, _size: Any) -> Any:
    """An index as it is."""
    return context.cast(builder, value, kind, types.intp if kind.signed else types.uintp)


arrayobj.fix_integer_index = _index


@dataclass(frozen=True, slots=True)
class Part:
    """A helper that lies apart, for arguments of certain types."""

    module: str  # Where it is defined
    name: str  # Its name there
    arguments: tuple[Any, ...]  # numba's types of its arguments

    @property
    def symbol(self) -> str:
        """Its name in object files."""
        text = f"{self.module} {' '.join(map(str, self.arguments))}"
        return f"{APART}{self.name.strip('_')}_{hashlib.sha256(text.encode()).hexdigest()[:12]}"


class LinkedLibrary(JITCodeLibrary):  # type: ignore[misc]
    """The intermediate code of one function, neither optimised nor turned into machine code."""

    def __init__(self, codegen: Any, name: str, part: Part | None = None) -> None:
        super().__init__(codegen, name)
        self.part = part
        self._whole: Any = None

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def add_linking_library(self, library: Any) -> None:
        self._linking_libraries.append(library)

    def finalize(self) -> None:
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        if self._whole is None:
            module, _ = linked(self, runtime=True)
            for function in module.functions:
                if not function.is_declaration and function.linkage == llvm.Linkage.external:
                    function.linkage = "linkonce_odr"
            self._whole = module
        return self._whole


def linked(library: Any, *, runtime: bool) -> tuple[Any, list[Part]]:
    """A module with the code of a library and of what it calls, each function once, and its parts."""
    module = library._final_module.clone()
    parts: list[Part] = []
    seen, waiting = {id(library)}, list(library._linking_libraries)
    while waiting:
        other = waiting.pop()
        if id(other) in seen or (other is rtsys.library and not runtime):
            continue
        seen.add(id(other))
        if not isinstance(other, LinkedLibrary):
            other._ensure_finalized()
            module.link_in(other._get_module_for_linking(), preserve=True)
        elif other.part is not None:
            parts.append(other.part)
        else:
            waiting.extend(other._linking_libraries)
            part = other._final_module.clone()
            for function in part.functions:
                if not function.is_declaration and function.linkage == llvm.Linkage.external:
                    function.linkage = "linkonce_odr"
            module.link_in(part)
    return module, sorted(set(parts), key=lambda one: one.symbol)


class _LinkedCompiler(numba_dispatcher._FunctionCompiler):  # type: ignore[misc,name-defined]
    """numba's compiler of one function, stopped at the intermediate code, or at the name of a part."""

    apart = False

    def _compile_core(self, args: Any, return_type: Any) -> Any:
        apart = self.apart and all(isinstance(one, _PLAIN) for one in args)
        return self._named(tuple(args)) if apart else self.whole(args, return_type)

    def whole(self, args: Any, return_type: Any) -> Any:
        """The compile result with the function's code."""
        flags = compiler.Flags()
        self.targetdescr.options.parse_as_flags(flags, self.targetoptions)
        flags.no_compile = True
        flags.no_cpython_wrapper = True
        flags.no_cfunc_wrapper = True
        context = self.targetdescr.target_context
        return compiler.compile_extra(
            self.targetdescr.typing_context,
            context,
            self.py_func,
            args=args,
            return_type=return_type,
            flags=flags,
            locals=self.locals,
            library=LinkedLibrary(context.codegen(), self.py_func.__qualname__),
            pipeline_class=self.pipeline_class,
        )

    def _named(self, args: tuple[Any, ...]) -> Any:
        """The compile result of a part: a symbol of another object file."""
        part = Part(self.py_func.__module__, self.py_func.__name__, args)
        result = result_of(self.py_func)
        names = self.py_func.__code__.co_varnames[: len(args)]
        described = FunctionDescriptor(
            True, part.module, part.name, part.name, "", None, result, None, names, {},
            mangler=lambda *_, **__: part.symbol, argtypes=args,
        )  # fmt: skip
        context = self.targetdescr.target_context
        return compiler.compile_result(
            typing_context=self.targetdescr.typing_context,
            target_context=context,
            signature=typing.signature(result, *args),
            library=LinkedLibrary(context.codegen(), part.name, part),
            fndesc=described,
        )


def result_of(function: Callable[..., Any]) -> Any:
    """The type of what a helper returns, as it is annotated; ``None`` if it cannot lie apart."""
    return _RESULTS.get(function.__annotations__.get("return", ""))


class Helper(CPUDispatcher):  # type: ignore[misc]
    """A function that compiled code calls; called from Python, it is compiled for itself on demand."""

    def __init__(
        self,
        function: Any,
        options: dict[str, Any],
        *,
        apart: bool = False,
        rare: bool = False,
        long: bool = False,
    ) -> None:
        super().__init__(function, {}, {"nopython": True, **options})
        self.apart, self.rare, self.long = apart, rare, long
        self._options = options
        self._alone: Any = None
        self._compiler = _LinkedCompiler(
            function, self.targetdescr, self.targetoptions, self.locals, compiler.Compiler
        )
        self._compiler.apart = apart

    def add_overload(self, cres: Any) -> None:
        """Make a compiled signature known to callers in compiled code, not to Python."""
        key = object()
        self.targetctx.insert_user_function(key, cres.fndesc, [cres.library])
        self.overloads[tuple(cres.signature.args)] = cres._replace(entry_point=key)

    def _compile_for_args(self, *args: Any, **kws: Any) -> Any:
        if self._alone is None:
            self._alone = numba.njit(**self._options)(self.py_func)
        return self._alone


def helper(
    function: F, *, fast: bool = True, apart: bool = False, rare: bool = False, long: bool = False
) -> F:
    """Compile a helper of the kernel as a part of the units that call it, or as one of its own."""
    # said either way: what is not said, numba takes from the function that calls the helper first
    options: dict[str, Any] = {"error_model": "numpy", "fastmath": FAST if fast else False}
    apart = apart and result_of(function) is not None
    compiled: Any = Helper(function, options, apart=apart, rare=rare, long=long)
    return compiled


def typed(function: Callable[..., int], arguments: int) -> Any:
    """The compile result of an entry point with integer arguments and an integer result, not yet linked."""
    dispatcher = Helper(function, {"error_model": "numpy", "fastmath": FAST})
    signature = types.int64(*(types.int64,) * arguments)
    dispatcher.compile(signature)
    return dispatcher.overloads[signature.args]


def typed_part(function: Any, part: Part) -> Any:
    """The compile result of a helper that lies apart, with its code, not yet linked."""
    return function._compiler.whole(part.arguments, result_of(function.py_func))


def context() -> Any:
    """numba's description of the processor."""
    return cpu_target.target_context
