"""Helpers of the kernel: linked into the entry points that call them, optimised there once and nowhere else.

numba compiles every function that another one calls for itself first: full optimisation, machine code,
verification. The caller then links the function's intermediate code and optimises it again; the rest is
thrown away, three quarters of a first compilation. Here a helper stops at its intermediate code. That
takes parts of numba that are not its public face, so ``use_plain_numba`` goes back to numba's own way.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import llvmlite.binding as llvm
import numba
from numba import types
from numba.core import compiler
from numba.core import dispatcher as numba_dispatcher
from numba.core.codegen import JITCodeLibrary
from numba.core.registry import CPUDispatcher
from numba.core.runtime import rtsys

F = TypeVar("F", bound=Callable[..., Any])

FAST = {"nsz", "contract", "arcp", "reassoc", "afn"}
"""LLVM's fast-math flags that the kernel allows; never nnan or ninf, as an infinite bound is no limit."""

_APART = ("noinline", "cold")
"""LLVM's attributes of a function that lies apart; branches that call it are taken to be unlikely."""


class _Way:
    """How helpers are compiled from now on."""

    def __init__(self) -> None:
        self.lean = True


_WAY = _Way()


class LinkedLibrary(JITCodeLibrary):  # type: ignore[misc]
    """The intermediate code of one function, neither optimised nor turned into machine code."""

    def __init__(self, codegen: Any, name: str, *, rare: bool = False) -> None:
        super().__init__(codegen, name)
        self._rare = rare
        self._whole: Any = None

    def add_ir_module(self, ir_module: Any) -> None:
        if self._rare:  # told in the source: llvmlite before 0.48 puts it on what the function returns
            for function in ir_module.functions:
                if not function.is_declaration and not function.linkage:
                    for attribute in _APART:
                        function.attributes.add(attribute)
        super().add_ir_module(ir_module)

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def add_linking_library(self, library: Any) -> None:
        self._linking_libraries.append(library)

    def finalize(self) -> None:
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        if self._whole is None:
            module: Any = linked(self, runtime=True)
            for function in module.functions:
                if not function.is_declaration and function.linkage == llvm.Linkage.external:
                    function.linkage = "linkonce_odr"
            self._whole = module
        return self._whole


def linked(library: Any, *, runtime: bool) -> Any:
    """A module with the code of a library and of everything that it calls, each function once.

    Args:
        library: of an entry point or a helper.
        runtime: whether numba's own memory runtime is linked, too.
    """
    module = library._final_module.clone()
    seen, waiting = {id(library)}, list(library._linking_libraries)
    while waiting:
        other = waiting.pop()
        if id(other) in seen or (other is rtsys.library and not runtime):
            continue
        seen.add(id(other))
        if isinstance(other, LinkedLibrary):
            waiting.extend(other._linking_libraries)
            part = other._final_module.clone()
            for function in part.functions:
                if not function.is_declaration and function.linkage == llvm.Linkage.external:
                    function.linkage = "linkonce_odr"
            module.link_in(part)
        else:
            other._ensure_finalized()
            module.link_in(other._get_module_for_linking(), preserve=True)
    return module


class _LinkedCompiler(numba_dispatcher._FunctionCompiler):  # type: ignore[misc,name-defined]
    """numba's compiler of one function, stopped at the intermediate code."""

    rare = False

    def _compile_core(self, args: Any, return_type: Any) -> Any:
        if not _WAY.lean:
            return super()._compile_core(args, return_type)
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
            library=LinkedLibrary(context.codegen(), self.py_func.__qualname__, rare=self.rare),
            pipeline_class=self.pipeline_class,
        )


class Helper(CPUDispatcher):  # type: ignore[misc]
    """A function that compiled code calls; called from Python, it is compiled for itself on demand."""

    def __init__(self, function: Any, options: dict[str, Any], rare: bool = False) -> None:
        super().__init__(function, {}, {"nopython": True, **options})
        self._options = options
        self._alone: Any = None
        self._compiler = _LinkedCompiler(
            function, self.targetdescr, self.targetoptions, self.locals, compiler.Compiler
        )
        self._compiler.rare = rare

    def add_overload(self, cres: Any) -> None:
        """Make a compiled signature known to callers in compiled code, not to Python."""
        if not isinstance(cres.library, LinkedLibrary):
            super().add_overload(cres)
            return
        key = object()
        self.targetctx.insert_user_function(key, cres.fndesc, [cres.library])
        self.overloads[tuple(cres.signature.args)] = cres._replace(entry_point=key)

    def _compile_for_args(self, *args: Any, **kws: Any) -> Any:
        if not _WAY.lean:
            return super()._compile_for_args(*args, **kws)
        if self._alone is None:
            self._alone = numba.njit(**self._options)(self.py_func)
        return self._alone


def helper(function: F, *, fast: bool = True, rare: bool = False) -> F:
    """Compile a helper of the kernel as a part of the entry points that call it.

    Args:
        function: with arguments that numba can type.
        fast: whether the fast-math flags ``FAST`` hold; without them its rounding stays as written.
        rare: whether most ticks do without it; its code then lies apart from that of its callers.
    """
    # said either way: what is not said, numba takes from the function that calls the helper first
    options: dict[str, Any] = {"error_model": "numpy", "fastmath": FAST if fast else False}
    compiled: Any = Helper(function, options, rare)
    return compiled


def typed(function: Callable[..., int], arguments: int) -> Any:
    """The compile result of an entry point with integer arguments and an integer result, not yet linked."""
    dispatcher = Helper(function, {"error_model": "numpy", "fastmath": FAST})
    signature = types.int64(*(types.int64,) * arguments)
    dispatcher.compile(signature)
    result = dispatcher.overloads[signature.args]
    if not isinstance(result.library, LinkedLibrary):
        raise TypeError(f"numba {numba.__version__} put {function.__name__} into a library of its own")
    return result


@contextmanager
def plain_numba() -> Iterator[None]:
    """Helpers that are first compiled inside are compiled in numba's own way."""
    before = _WAY.lean
    _WAY.lean = False
    try:
        yield
    finally:
        _WAY.lean = before


def use_plain_numba() -> None:
    """Compile every helper in numba's own way from now on."""
    _WAY.lean = False
