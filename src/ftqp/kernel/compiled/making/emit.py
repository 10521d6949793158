"""From a unit of the kernel to its machine code, by numba and LLVM.

A unit is an entry point or a helper that lies apart. Its object code is complete but for other units, the
table of facts, and functions of the C library and of Python's C interface. An entry point has one symbol that
Python can call (``METH_FASTCALL``), or C, a part one that other units call.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba.core import cgutils
from numba.core.compiler_lock import global_compiler_lock

from ftqp.kernel.compiled.entry_point import EntryPoint
from ftqp.kernel.compiled.facts import FIRST, LAST, RUNTIME_ERROR, SIZE, SYMBOL, TYPE_ERROR
from ftqp.kernel.compiled.making.helper import APART, Part, context, linked, typed, typed_part
from ftqp.kernel.compiled.making.processor import Target

_ADDRESS = "numba.dynamic.globals"  # how numba begins the names of addresses in constants

C_SYMBOL = "ftqp_c_"
"""How the symbols of entry points that C calls begin; a library shows its users others."""
FAILED_IN_C = -999
"""What C gets where compiled code has failed, which formulas of the kernel never do."""
LONG_AGO = 1 << 17
"""Time after which code is taken to be no longer in the caches [cycles of the processor's counter]."""
MOST_CODE = 1 << 16
"""How much code is asked for at most [bytes]."""
LINE = 64
"""Of a cache [bytes]."""

LONG = ir.IntType(64)
OBJECT = ir.IntType(8).as_pointer()


def entry_code(entry: EntryPoint, capacity: int, target: Target) -> tuple[bytes, list[Part]]:
    """The object file of an entry point, and the parts that it needs.

    Args:
        entry: with int64 arguments and an int64 result.
        capacity: how many joints its records have room for; 0 is any number.
        target: the processor that the code is for.

    Raises:
        TypeError: if the code allocates memory or contains an address of this process.
    """
    with global_compiler_lock, _no_garbage_collection():
        result = typed(entry.function(capacity), len(entry.signature))
        if entry.caller == "c":
            wrapper = _c_function(result.fndesc, entry, capacity)
        else:
            wrapper = _python_function(result.fndesc, entry, capacity, target.triple)
        module, parts = linked(result.library, runtime=False)
    module.link_in(llvm.parse_assembly(cgutils.normalize_ir_text(str(wrapper))))
    return _finished(module, entry.symbol(capacity), target, long_loops=not capacity), parts


def part_code(part: Part, function: Any, target: Target) -> tuple[bytes, list[Part]]:
    """The object file of a helper that lies apart, and the parts that it needs; as ``entry_code``.

    Args:
        part: which.
        function: the helper.
        target: the processor that the code is for.
    """
    with global_compiler_lock, _no_garbage_collection():
        result = typed_part(function, part)
        module, parts = linked(result.library, runtime=False)
    module.get_function(result.fndesc.llvm_func_name).name = part.symbol
    return _finished(module, part.symbol, target, long_loops=function.long), parts


def frame_code(target: Target) -> bytes:
    """The object file of what the units of a library share: the table of facts."""
    module = ir.Module()
    table = ir.GlobalVariable(module, ir.ArrayType(LONG, SIZE), SYMBOL)
    table.initializer = ir.Constant(table.value_type, None)
    return _emitted(llvm.parse_assembly(str(module)), target)


def mark_code(symbol: str, target: Target) -> bytes:
    """The object file of a function that does nothing: its place is where the code before it ends."""
    module = ir.Module()
    function = ir.Function(module, ir.FunctionType(ir.VoidType(), []), symbol)
    ir.IRBuilder(function.append_basic_block()).ret_void()
    parsed = llvm.parse_assembly(str(module))
    parsed.get_function(symbol).visibility = "hidden"
    return _emitted(parsed, target)


def _finished(module: Any, symbol: str, target: Target, *, long_loops: bool) -> bytes:
    """The object file of a linked module, of which others see one symbol.

    Loops over few joints end before vectors pay; left as they are, the code is a third as long.
    """
    module.link_in(llvm.parse_assembly(str(_no_memory_runtime(module))))
    for value in (*module.functions, *module.global_variables):
        if value.name.startswith((APART, FIRST, LAST, C_SYMBOL)):
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


def _emitted(module: Any, target: Target) -> bytes:
    machine = target.machine()
    _meant_for(module, target, machine)
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


def _fetch_code(builder: Any, first: Any, last: Any) -> None:
    """Ask for all code from one function to another at once, where the last call is long ago.

    A loop that slept between two ticks may find the code of a tick in the caches no longer, and would wait
    for memory line after line. It is asked for into the second level, as the first holds data only.
    """
    number, nothing = ir.IntType(32), ir.VoidType()

    def intrinsic(name: str, result: Any, *arguments: Any) -> Any:
        return cgutils.get_or_insert_function(builder.module, ir.FunctionType(result, arguments), name)

    fetch = intrinsic("llvm.prefetch.p0", nothing, OBJECT, number, number, number)
    place = ir.GlobalVariable(builder.module, LONG, "last_call")
    place.initializer = LONG(0)
    now = builder.call(intrinsic("llvm.readcyclecounter", LONG), [])
    past = builder.sub(now, builder.load(place))
    builder.store(now, place)
    with builder.if_then(builder.icmp_unsigned(">", past, LONG(LONG_AGO)), likely=False):
        begin = builder.ptrtoint(first, LONG)
        length = builder.sub(builder.ptrtoint(last, LONG), begin)
        length = builder.select(builder.icmp_signed("<", length, LONG(MOST_CODE)), length, LONG(MOST_CODE))
        with cgutils.for_range_slice(builder, LONG(0), length, LONG(LINE), LONG) as (at, _):
            line = builder.inttoptr(builder.add(begin, at), OBJECT)
            builder.call(fetch, [line, number(0), number(2), number(1)])


def _python_function(fndesc: Any, entry: EntryPoint, capacity: int, triple: str) -> Any:
    """The module with ``PyObject *symbol(PyObject *self, PyObject **arguments, Py_ssize_t count)``."""
    symbol, signature, convention = entry.symbol(capacity), entry.signature, context().call_conv
    module = context().create_module(f"python {symbol}")
    callee = ir.Function(
        module, convention.get_function_type(fndesc.restype, fndesc.argtypes), fndesc.llvm_func_name
    )
    function = ir.Function(module, ir.FunctionType(OBJECT, [OBJECT, OBJECT.as_pointer(), LONG]), symbol)
    facts = ir.GlobalVariable(module, ir.ArrayType(LONG, SIZE), SYMBOL)
    _, arguments, count = function.args
    builder = ir.IRBuilder(function.append_basic_block("entry"))
    if capacity and triple.startswith("x86_64"):  # elsewhere a program may not read the counter
        nothing = ir.FunctionType(ir.VoidType(), [])
        _fetch_code(builder, *(ir.Function(module, nothing, f"{end}{capacity}") for end in (FIRST, LAST)))
    python = _PythonCalls(builder, facts)
    with builder.if_then(builder.icmp_signed("!=", count, LONG(len(signature))), likely=False):
        python.fail(TYPE_ERROR, f"{symbol} takes {len(signature)} arguments")
    values = []
    for index, letter in enumerate(signature):
        given = builder.load(builder.gep(arguments, [LONG(index)]))
        values.append(builder.ptrtoint(given, LONG) if letter == "o" else python.integer(given))
    state = python.call("PyEval_SaveThread", OBJECT) if entry.nogil else None
    status, answer = convention.call_function(builder, callee, fndesc.restype, fndesc.argtypes, values)
    if state is not None:
        python.call("PyEval_RestoreThread", ir.VoidType(), state)
    with builder.if_then(status.is_error, likely=False):
        python.fail(RUNTIME_ERROR, f"{symbol} failed in compiled code")
    builder.ret(python.call("PyLong_FromLongLong", OBJECT, answer))
    return module


def _c_function(fndesc: Any, entry: EntryPoint, capacity: int) -> Any:
    """The module with ``int64_t symbol(int64_t, ...)``."""
    symbol, convention = entry.symbol(capacity), context().call_conv
    module = context().create_module(f"c {symbol}")
    callee = ir.Function(
        module, convention.get_function_type(fndesc.restype, fndesc.argtypes), fndesc.llvm_func_name
    )
    function = ir.Function(module, ir.FunctionType(LONG, [LONG] * len(entry.signature)), symbol)
    builder = ir.IRBuilder(function.append_basic_block("entry"))
    status, answer = convention.call_function(
        builder, callee, fndesc.restype, fndesc.argtypes, list(function.args)
    )
    with builder.if_then(status.is_error, likely=False):
        builder.ret(LONG(FAILED_IN_C))
    builder.ret(answer)
    return module


class _PythonCalls:
    """Calls of Python's C interface, in a function that returns an object."""

    def __init__(self, builder: Any, facts: Any) -> None:
        self._builder = builder
        self._facts = facts

    def call(self, name: str, result: Any, *arguments: Any) -> Any:
        """Call the C function of that name."""
        kind = ir.FunctionType(result, [argument.type for argument in arguments])
        function = cgutils.get_or_insert_function(self._builder.module, kind, name)
        return self._builder.call(function, arguments)

    def integer(self, given: Any) -> Any:
        """The value of a Python integer; returns NULL from the function where it is none."""
        value = self.call("PyLong_AsLongLong", LONG, given)
        with self._builder.if_then(self._builder.icmp_signed("==", value, LONG(-1)), likely=False):
            raised = self._builder.icmp_unsigned("!=", self.call("PyErr_Occurred", OBJECT), OBJECT(None))
            with self._builder.if_then(raised, likely=False):
                self._builder.ret(OBJECT(None))
        return value

    def fail(self, exception: int, sentence: str) -> None:
        """Raise the Python exception at that place of the table of facts, and return from the function."""
        builder = self._builder
        kind = builder.load(builder.gep(self._facts, [LONG(0), LONG(exception)]))
        text = cgutils.global_constant(
            builder.module, "sentence", cgutils.make_bytearray(sentence.encode() + b"\0")
        )
        self.call(
            "PyErr_SetString",
            ir.VoidType(),
            builder.inttoptr(kind, OBJECT),
            builder.bitcast(text, OBJECT),
        )
        builder.ret(OBJECT(None))
