import ctypes
from functools import partial
from time import sleep

import numpy as np
import pytest

from ftqp.kernel.compiled.mode import COMPILED

if not COMPILED:
    pytest.skip("the kernel runs as plain Python", allow_module_level=True)

import numba

from ftqp.kernel.compiled.machine_code import linked_function
from ftqp.kernel.compiled.making.emit import object_code
from ftqp.kernel.compiled.making.lean import helper, plain_numba
from ftqp.kernel.compiled.making.processor import this_machine
from ftqp.kernel.compiled.symbols import symbols_of
from ftqp.kernel.jit import carray, pointer

PREFETCH = b"\x0f\x18"
"""How the instruction begins."""


@helper
def half(x: float) -> float:
    return x / 2.0


@helper
def mean(x: float, y: float) -> float:
    return half(x) + half(y)


@helper
def middle(X: np.ndarray) -> float:
    return mean(X[0], X[-1])


def test_helper_called_from_python_computes() -> None:
    assert mean(1.0, 4.0) == 2.5
    assert middle(np.array([1.0, 9.0, 3.0])) == 2.0


def test_helper_is_part_of_numba_functions_too() -> None:
    @numba.njit
    def outer(x: float) -> float:
        return 10.0 * mean(x, x)

    assert outer(3.0) == 30.0


def test_helper_compiled_in_numbas_own_way_gives_the_same() -> None:
    @helper
    def third(x: float) -> float:
        return x / 3.0

    @helper
    def both(x: float) -> float:
        return third(x) + third(-2.0 * x)

    with plain_numba():
        assert both(6.0) == -2.0
        with pytest.raises(TypeError, match="library of its own"):
            object_code(lambda k: k, symbol="k", signature="i", nogil=False, target=this_machine())
    assert both(9.0) == -3.0


def test_object_file_shows_one_function_and_needs_no_numba() -> None:
    def entry(count: int) -> int:
        return int(mean(float(count), 4.0))

    code = object_code(entry, symbol="shown", signature="i", nogil=False, target=this_machine())
    function = linked_function(code, "shown")
    assert function is not None and function(6) == 5
    assert linked_function(code, "another") is None
    symbols = symbols_of(code)
    if symbols is not None:
        assert symbols.defined == {"shown", "shown_facts"}
        assert not [name for name in symbols.needed if "NRT" in name or "numba" in name]


def test_code_that_allocates_is_refused() -> None:
    def entry(count: int) -> int:
        X = np.ones(count)
        X[0] = 2.0
        return int(X.sum())

    with pytest.raises(TypeError, match="allocate nothing"):
        object_code(entry, symbol="allocates", signature="i", nogil=False, target=this_machine())


def test_code_with_an_address_of_this_process_is_refused() -> None:
    outside = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(lambda x: x)

    def entry(count: int) -> int:
        return int(outside(float(count)))

    with pytest.raises(TypeError, match="address of this process"):
        object_code(entry, symbol="addressed", signature="i", nogil=False, target=this_machine())


def test_code_of_a_rare_helper_lies_apart() -> None:
    @partial(helper, rare=True)
    def seldom(x: float) -> float:
        return 3.0 * x

    def entry(count: int) -> int:
        return int(mean(float(count), 4.0)) if count > 0 else int(seldom(float(count)))

    def plain(count: int) -> int:
        return int(mean(float(count), 4.0)) if count > 0 else int(half(float(count)))

    code = object_code(entry, symbol="apart", signature="i", nogil=False, target=this_machine())
    function = linked_function(code, "apart")
    assert function is not None and (function(6), function(-6)) == (5, -18)
    together = object_code(plain, symbol="together", signature="i", nogil=False, target=this_machine())
    if symbols_of(code) is not None:
        assert b".text.unlikely" in code and b".text.unlikely" not in together


def test_entry_called_again_after_a_pause_gives_the_same() -> None:
    def entry(count: int) -> int:
        return int(mean(float(count), 4.0))

    code = object_code(entry, symbol="paced", signature="i", nogil=False, target=this_machine())
    function = linked_function(code, "paced")
    assert function is not None
    for pause in (0.0, 0.0, 1e-3, 1e-2):
        sleep(pause)
        assert function(6) == 5
    if this_machine().triple.startswith("x86_64"):
        assert PREFETCH in code


def test_loops_over_few_joints_are_left_as_they_are() -> None:
    def entry(address: int, count: int) -> int:
        x = carray(pointer(address), (2, 64), np.dtype(np.float64))
        for i in range(count):
            x[0, i] = 2.0 * x[1, i] + 1.0
        return count

    sizes = {}
    for capacity in (8, 32):
        code = object_code(
            entry, symbol="loop", signature="ii", nogil=False, target=this_machine(), capacity=capacity
        )
        function = linked_function(code, "loop")
        numbers = np.arange(128.0).reshape(2, 64)
        assert function is not None and function(numbers.ctypes.data, 50) == 50
        np.testing.assert_array_equal(numbers[0, :50], 2.0 * numbers[1, :50] + 1.0)
        assert (numbers[0, 50:] == np.arange(50.0, 64.0)).all()
        sizes[capacity] = len(code)
    assert sizes[8] < sizes[32]


@pytest.mark.parametrize("share", [0.02, 0.2, 0.5, 0.9, 0.99])
def test_truncated_object_file_is_an_error_never_a_crash(share: float) -> None:
    def entry(count: int) -> int:
        return count

    code = object_code(entry, symbol="whole", signature="i", nogil=False, target=this_machine())
    if symbols_of(code) is None:
        pytest.skip("no ELF object file")
    part = code[: int(share * len(code))]
    assert linked_function(part, "whole") is None
