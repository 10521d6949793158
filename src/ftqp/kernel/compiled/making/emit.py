"""From a unit of the kernel to its machine code, by numba and LLVM.

A unit is an entry point or a helper that lies apart. Its object code is complete but for other units and
functions of the C library and of ``glue.c``. An entry point has one symbol that C calls, a part one that
other units call.
"""

import gc
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba.core import cgutils
from numba.core.compiler_lock import global_compiler_lock

from ftqp.kernel.compiled.library import LEVELS, EntryPoint, level_here
from ftqp.kernel.compiled.making.helper import APART, Part, context, linked, typed, typed_part

_ADDRESS = "numba.dynamic.globals"  # how numba begins the names of addresses in constants

C_SYMBOL = "ftqp_c_"
"""How the symbols of entry points that C calls begin; a library shows its users others."""
FAILED = {"c": -999, "python": -(1 << 63)}
"""What callers get where compiled code has failed, which formulas of the kernel never do."""

LONG = ir.IntType(64)
OBJECT = ir.IntType(8).as_pointer()
GLUE = ("ftqp_take",)
"""What other units have of ``glue.c``."""

WASM_FEATURES = "+simd128,+bulk-memory"
"""What every browser has since 2021: lanes of two doubles, and copies of memory as instructions."""


@dataclass(frozen=True, slots=True)
class Target:
    """A class of processors."""

    triple: str  # Architecture, vendor and operating system
    cpu: str  # LLVM's name of the class; code for it may use everything that such a processor has

    @property
    def architecture(self) -> str:
        """The first part of the triple."""
        return self.triple.partition("-")[0]

    @property
    def is_foreign(self) -> bool:
        """Whether memory is laid out as on another processor with addresses of 64 bits.

        numba's code takes addresses for 64 bits long, so that its layout is kept where they are shorter.
        """
        own = str(llvm.get_process_triple()).partition("-")[0]
        return self.architecture not in (own, "wasm32")

    def machine(self) -> Any:
        """LLVM's generator of code for it, position-independent where libraries are shared."""
        wasm = self.architecture == "wasm32"
        if wasm or self.is_foreign:
            llvm.initialize_all_targets()
            llvm.initialize_all_asmprinters()
        else:
            llvm.initialize_native_target()
            llvm.initialize_native_asmprinter()
        return llvm.Target.from_triple(self.triple).create_target_machine(
            cpu=self.cpu, features=WASM_FEATURES if wasm else "", opt=3,
            reloc="static" if wasm else "pic", codemodel="default",
        )  # fmt: skip


def target(cpu: str | None = None) -> Target:
    """A class of processors of this architecture; the best that this machine belongs to if none is named."""
    found = level_here() if cpu is None else cpu
    if found not in LEVELS.get(platform.machine(), {}):
        raise LookupError(f"no class of processors is named for {platform.machine()} {cpu or ''}".rstrip())
    return Target(triple=str(llvm.get_process_triple()), cpu=found)


def entry_code(entry: EntryPoint, joints: int, target: Target) -> tuple[bytes, list[Part]]:
    """The object file of an entry point, and the parts that it needs."""
    with global_compiler_lock, _no_garbage_collection():
        result = typed(entry.function(joints), len(entry.signature))
        wrapper = _wrapper(result.fndesc, entry)
        module, parts = linked(result.library, runtime=False)
    module.link_in(llvm.parse_assembly(cgutils.normalize_ir_text(str(wrapper))))
    return _finished(module, entry.symbol, target, long_loops=entry.alone), parts


def part_code(part: Part, function: Any, target: Target) -> tuple[bytes, list[Part]]:
    """The object file of a helper that lies apart, and the parts that it needs; as ``entry_code``."""
    with global_compiler_lock, _no_garbage_collection():
        result = typed_part(function, part)
        module, parts = linked(result.library, runtime=False)
    module.get_function(result.fndesc.llvm_func_name).name = part.symbol
    return _finished(module, part.symbol, target, long_loops=function.long), parts


def _finished(module: Any, symbol: str, target: Target, *, long_loops: bool) -> bytes:
    """The object file of a linked module, of which others see one symbol.

    Loops over few joints end before vectors pay; left as they are, the code is a third as long.
    """
    module.link_in(llvm.parse_assembly(str(_no_memory_runtime(module))))
    for value in (*module.functions, *module.global_variables):
        if value.name in GLUE or value.name.startswith((APART, C_SYMBOL)):
            value.visibility = "hidden"
        if not value.is_declaration and value.name != symbol:
            # an address of this process, if it is used, stays visible for the check below
            value.linkage = "linkonce_any" if value.name.startswith(_ADDRESS) else "internal"
    machine = target.machine()
    _meant_for(module, target, machine)
    module.verify()
    _optimise(module, machine, long_loops=long_loops)
    _check(module, symbol)
    return bytes(machine.emit_object(module))


def _meant_for(module: Any, target: Target, machine: Any) -> None:
    """Tell a module its processor, and how that lays out memory where it is no processor of this kind."""
    module.triple = target.triple
    if target.is_foreign:
        module.data_layout = str(machine.target_data)


def _optimise(module: Any, machine: Any, *, long_loops: bool) -> None:
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = options.loop_unrolling = long_loops
    options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)


def _check(module: Any, symbol: str) -> None:
    """Refuse code that only a process with numba in it could run."""
    for value in (*module.functions, *module.global_variables):
        if value.is_declaration and value.name.startswith(("NRT_", "numba_", "_ZN5numba", ".numba")):
            raise TypeError(f"{symbol} needs {value.name}; entry points allocate nothing and call no numba")
        if value.name.startswith(_ADDRESS):
            raise TypeError(f"{symbol} contains an address of this process; it could not be kept on disk")


@contextmanager
def _no_garbage_collection() -> Iterator[None]:
    """Compiling makes millions of small objects that live to its end; looking through them costs a tenth."""
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if before:
            gc.enable()


def _no_memory_runtime(module: Any) -> ir.Module:
    """Counting references does nothing: no array of the kernel owns its memory, and none is allocated."""
    runtime = ir.Module()
    runtime.triple, runtime.data_layout = module.triple, module.data_layout
    declared = {function.name for function in module.functions if function.is_declaration}
    for name in sorted({"NRT_incref", "NRT_decref"} & declared):
        function = ir.Function(runtime, ir.FunctionType(ir.VoidType(), [OBJECT]), name)
        ir.IRBuilder(function.append_basic_block()).ret_void()
    return runtime


def _wrapper(fndesc: Any, entry: EntryPoint) -> Any:
    """The module with ``int64_t symbol(int64_t, ...)`` for C, or with a pointer to those for ``glue.c``."""
    symbol, convention, count = entry.symbol, context().call_conv, len(entry.signature)
    module = context().create_module(f"{entry.caller} {symbol}")
    callee = ir.Function(
        module, convention.get_function_type(fndesc.restype, fndesc.argtypes), fndesc.llvm_func_name
    )
    packed = entry.caller == "python"
    takes = [LONG.as_pointer()] if packed else [LONG] * count
    function = ir.Function(module, ir.FunctionType(LONG, takes), symbol)
    builder = ir.IRBuilder(function.append_basic_block())
    values = list(function.args)
    if packed:
        values = [builder.load(builder.gep(function.args[0], [LONG(k)])) for k in range(count)]
    status, answer = convention.call_function(builder, callee, fndesc.restype, fndesc.argtypes, values)
    with builder.if_then(status.is_error, likely=False):
        builder.ret(LONG(FAILED[entry.caller]))
    builder.ret(answer)
    return module
