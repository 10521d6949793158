import ctypes
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ftqp.kernel.compiled.entry_point import EntryPoint
from ftqp.kernel.compiled.mode import COMPILED

needs_numba = pytest.mark.skipif(not COMPILED, reason="the kernel runs as plain Python")

USE = """
import sys
import numpy as np
from pathlib import Path
from ftqp.kernel.compiled.entry_point import EntryPoint
from ftqp.kernel.compiled.kernel import Kernel
sys.path.insert(0, {source!r})
entry = EntryPoint(name="summed", module={module!r}, factory="summed", signature="ii")
function = Kernel(Path({source!r}), {ahead}).load(entry, 8)
record = np.append(np.linspace(-2.0, 3.0, 8), 0.0)
assert function(record.ctypes.data, 8) == 16
print(record[8].hex(), "numba" in sys.modules, {module!r} in sys.modules, "llvmlite" in sys.modules)
"""


def used(tiny: Any, ahead: Path | None = None, **environment: str) -> list[str]:
    """What a new process says: the result's bits; whether numba, the formulas, llvmlite were imported."""
    place = "None" if ahead is None else f"Path({str(ahead)!r})"
    program = USE.format(source=str(tiny.source), module=tiny.module, ahead=place)
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr == ""
    return done.stdout.split()


def sum_of(function: Any) -> float:
    record = np.append(np.linspace(-2.0, 3.0, 8), 0.0)
    assert function(record.ctypes.data, 8) == 16
    return float(record[8])


def expected() -> float:
    X = np.linspace(-2.0, 3.0, 8)
    return float(np.sum(np.sin(X) * np.sqrt(np.arange(8) + 1.0) + X / 3.0))


def test_compiled_entry_point_computes_its_formula(tiny: Any) -> None:
    assert sum_of(tiny.kernel().load(tiny.summed, 8)) == pytest.approx(expected(), abs=1e-14)


def test_each_capacity_has_a_record_of_its_own(tiny: Any) -> None:
    kernel = tiny.kernel()
    assert [kernel.load(tiny.summed, capacity)(np.zeros(40).ctypes.data, 1) for capacity in (8, 16, 32)] == [
        9,
        17,
        33,
    ]


@needs_numba
def test_second_process_needs_neither_numba_nor_formulas_and_gets_the_same_bits(tiny: Any) -> None:
    first, second = used(tiny), used(tiny)
    assert first[1:] == ["True", "True", "True"]
    assert second[1:] == ["False", "False", "True"]
    assert first[0] == second[0]
    assert first[0] == sum_of(tiny.kernel().load(tiny.summed, 8)).hex()


def test_plain_python_runs_the_same_formulas(tiny: Any) -> None:
    bits, *imported = used(tiny, NUMBA_DISABLE_JIT="1")
    assert float.fromhex(bits) == pytest.approx(expected(), abs=1e-14)
    assert imported == ["False", "True", "False"]
    assert not tiny.cache.exists()


@needs_numba
@pytest.mark.parametrize("entry", ["summed", "taken"])
def test_wrong_arguments_are_errors_of_the_caller(tiny: Any, entry: str) -> None:
    function = tiny.kernel().load(tiny.entry(entry, {"summed": "ii", "taken": "oii"}[entry]), 8)
    last = [0.0] if entry == "taken" else []
    for few in ((), (*last,), (*last, 1), (*last, 1, 2, 3)):
        with pytest.raises(TypeError, match="arguments"):
            function(*few)
    for wrong in (1.5, "1", None, np.zeros(1)):
        with pytest.raises(TypeError):
            function(*last, wrong, 1)
    with pytest.raises(OverflowError):
        function(*last, 2**63, 1)


@needs_numba
def test_error_in_compiled_code_is_an_exception(tiny: Any) -> None:
    function = tiny.kernel().load(tiny.entry("fails", "i"), 8)
    assert function(-1) == -1
    with pytest.raises(RuntimeError, match="fails"):
        function(1)


@needs_numba
def test_missing_names_what_would_be_compiled_and_announces_it_once(tiny: Any) -> None:
    announced: list[str] = []

    @contextmanager
    def announce() -> Iterator[None]:
        announced.append("begin")
        yield
        announced.append("end")

    wanted = [(tiny.summed, 8), (tiny.entry("fails", "i"), 8)]
    kernel = tiny.kernel()
    kernel.load(tiny.summed, 8)
    assert tiny.kernel().missing(wanted) == wanted[1:]
    kernel.compile_ahead(wanted, announce)
    assert announced == ["begin", "end"]
    kernel.compile_ahead(wanted, announce)
    tiny.kernel().compile_ahead(wanted, announce)
    assert announced == ["begin", "end"]
    assert tiny.kernel().missing(wanted) == []


@needs_numba
def test_changed_source_is_compiled_anew(tiny: Any) -> None:
    tiny.kernel().load(tiny.summed, 8)
    (tiny.source / "beside.py").write_text("changed = True\n")
    assert tiny.kernel().missing([(tiny.summed, 8)]) == [(tiny.summed, 8)]


@needs_numba
def test_other_python_threads_run_beside_an_entry_point_that_releases_the_interpreter(tiny: Any) -> None:
    function = tiny.kernel().load(tiny.entry("waiting", "ii", nogil=True), 8)
    flag = np.zeros(1)
    timer = threading.Timer(0.05, lambda: flag.__setitem__(0, 1.0))
    timer.start()
    assert function(flag.ctypes.data, 200_000_000) == 1
    timer.join()


def _half(content: bytes) -> bytes:
    return content[: len(content) // 2]


def _other_processor(content: bytes) -> bytes:
    return content.replace(b'"cpu": "', b'"cpu": "another ')


def _flipped(content: bytes) -> bytes:
    return content[:-50] + bytes([content[-50] ^ 1]) + content[-49:]


def _pickled(content: bytes) -> bytes:
    return b"cos\nsystem\n(S'touch /tmp/never'\ntR."


@needs_numba
@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (lambda content: b"", True),
        (lambda content: b"\n" * 100, True),
        (lambda content: b"ftqp compiled kernel\n{" + b"[" * 50_000 + b"\n", True),
        (lambda content: content + b"more", True),
        (lambda content: content[:30], True),
        (lambda content: content[:-1], True),
        (lambda content: content.replace(b'"format": 1', b'"format": 2'), False),
        (_half, True),
        (_other_processor, False),
        (_flipped, True),
        (_pickled, True),
    ],
)
def test_damaged_file_is_compiled_anew_and_replaced(
    tiny: Any, damage: Any, told: bool, log: pytest.LogCaptureFixture
) -> None:
    before = sum_of(tiny.kernel().load(tiny.summed, 8))
    (file,) = tiny.files()
    whole = file.read_bytes()
    file.write_bytes(damage(whole))
    assert file.read_bytes() != whole
    kernel = tiny.kernel()
    assert kernel.missing([(tiny.summed, 8)]) == [(tiny.summed, 8)]
    assert sum_of(kernel.load(tiny.summed, 8)) == before
    assert tiny.kernel().missing([(tiny.summed, 8)]) == []
    assert len(log.messages) == told
    assert all(f"{file} is damaged, so its machine code is not loaded" in said for said in log.messages)


@needs_numba
def test_file_that_others_can_write_is_compiled_anew_and_replaced(
    tiny: Any, log: pytest.LogCaptureFixture
) -> None:
    tiny.kernel().load(tiny.summed, 8)
    (file,) = tiny.files()
    file.chmod(0o666)
    assert sum_of(tiny.kernel().load(tiny.summed, 8)) == pytest.approx(expected(), abs=1e-14)
    assert [f"{file} is no file of yours that only you can write" in said for said in log.messages] == [True]
    assert file.stat().st_mode & 0o777 == 0o600


@needs_numba
def test_file_of_another_entry_point_is_not_taken(tiny: Any) -> None:
    other = tiny.entry("fails", "i")
    tiny.kernel().compile_ahead([(tiny.summed, 8), (other, 8)])
    fails, summed = tiny.files()
    summed.write_bytes(fails.read_bytes())
    assert sum_of(tiny.kernel().load(tiny.summed, 8)) == pytest.approx(expected(), abs=1e-14)


@needs_numba
def test_folder_where_a_file_should_be_costs_one_sentence(tiny: Any, log: pytest.LogCaptureFixture) -> None:
    tiny.kernel().load(tiny.summed, 8)
    (file,) = tiny.files()
    file.unlink()
    file.mkdir()
    (file / "inside").touch()
    kernel = tiny.kernel()
    assert sum_of(kernel.load(tiny.summed, 8)) == pytest.approx(expected(), abs=1e-14)
    assert len(log.messages) == 1 and "cannot be written" in log.messages[0]


def test_entry_points_are_checked_when_they_are_named() -> None:
    with pytest.raises(ValueError, match="letters i and o"):
        EntryPoint(name="a", module="m", factory="f", signature="ix")
    with pytest.raises(ValueError, match="identifier"):
        EntryPoint(name="a b", module="m", factory="f", signature="i")
    with pytest.raises(ValueError, match="no Python object"):
        EntryPoint(name="a", module="m", factory="f", signature="o", nogil=True)


@needs_numba
def test_numba_that_cannot_do_it_the_lean_way_compiles_its_own_way(tiny: Any) -> None:
    program = """
import logging, sys
import numpy as np
import ftqp.kernel.compiled.making.emit as emit
def broken(*arguments, **options):
    raise AttributeError("numba has changed")
emit.object_code = broken
""" + USE.replace(
        "print(",
        'taken = Kernel(Path({source!r})).load(EntryPoint(name="taken", module={module!r}, factory="taken",'
        ' signature="oii"), 8)\nassert taken(record, record.ctypes.data, 9) == 9\nprint(',
    ).format(source=str(tiny.source), module=tiny.module, ahead="None")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert float.fromhex(done.stdout.split()[0]) == pytest.approx(expected(), abs=1e-14)
    assert done.stderr.count("\n") == 1 and "numba has changed" in done.stderr
    assert tiny.files() == []


@needs_numba
def test_compiled_function_is_fast_to_call_because_python_calls_it_directly(tiny: Any) -> None:
    function = tiny.kernel().load(tiny.summed, 8)
    assert type(function).__name__ == "builtin_function_or_method"
    assert ctypes.pythonapi.PyCFunction_GetFlags(ctypes.py_object(function)) == 0x80


@needs_numba
@pytest.mark.slow
def test_two_processes_that_compile_at_the_same_time_do_not_meet(tiny: Any) -> None:
    with ThreadPoolExecutor(2) as both:
        first, second = both.map(lambda _: used(tiny), range(2))
    assert first[0] == second[0] and float.fromhex(first[0]) == pytest.approx(expected(), abs=1e-14)
    assert len(tiny.files()) == 1
    assert used(tiny)[0] == first[0]
