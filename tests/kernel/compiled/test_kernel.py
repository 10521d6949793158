"""The kernel of a process: functions of the built library, or plain Python and one sentence."""

import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ftqp.kernel.compiled.library import Kernel
from ftqp.kernel.layout.enums import JOINTS

ROW = np.dtype([("x", np.float64, (JOINTS,)), ("sum", np.float64)])


def sum_of(function: Any) -> float:
    """What the entry point ``summed`` makes of the numbers 0 to 4."""
    record = np.zeros(1, ROW)
    record["x"][0, :5] = np.arange(5.0)
    assert function(record.ctypes.data, 5) == 5 + JOINTS
    return float(record["sum"][0])


def expected() -> float:
    x = np.arange(5.0)
    return float((np.sin(x) * np.sqrt(x + 1.0) + x / 3.0).sum())


def test_built_function_computes_its_formula(ready: Any, log: Any) -> None:
    function = ready.kernel().load(ready.summed)
    assert isinstance(function, type(len)) and not log.messages
    assert sum_of(function) == pytest.approx(expected(), rel=1e-15)


def test_plain_python_does_what_is_not_built_and_one_sentence_says_so(tiny: Any, log: Any) -> None:
    kernel = tiny.kernel()
    assert sum_of(kernel.load(tiny.summed)) == pytest.approx(expected(), rel=1e-15)
    (said,) = log.messages
    assert said.startswith("the kernel is not built; plain Python does its work") and "make kernel" in said


def test_entry_point_that_the_library_lacks_is_plain_python_and_named(ready: Any, log: Any) -> None:
    kernel = ready.kernel()
    entry = ready.entry("fails", "i")
    assert kernel.load(entry)(7) == 7
    assert not isinstance(kernel.load(ready.entry("summed", "iii")), type(len)), "of another signature"
    (said,) = log.messages
    assert "the built kernel has no" in said


def test_wrong_arguments_are_errors_of_the_caller(ready: Any) -> None:
    function = ready.kernel().load(ready.summed)
    for arguments in ((), (1,), (1, 2, 3)):
        with pytest.raises(TypeError, match="ftqp_summed takes 2 arguments"):
            function(*arguments)
    with pytest.raises(TypeError, match="integer"):
        function("address", 1)
    with pytest.raises(OverflowError):
        function(2**80, 1)


def test_error_in_compiled_code_is_an_exception(ready: Any) -> None:
    function = ready.kernel().load(ready.entry("fails", "i"))
    assert function(3) == 3
    with pytest.raises(RuntimeError, match="ftqp_fails failed in compiled code"):
        function(1)


def test_other_python_threads_run_beside_an_entry_point_that_releases_the_interpreter(ready: Any) -> None:
    flag = np.zeros(1)
    function = ready.kernel().load(ready.entry("waiting", "ii", nogil=True))
    timer = threading.Timer(0.05, lambda: flag.fill(1.0))
    timer.start()
    assert function(flag.ctypes.data, 10**9) == 1
    timer.join()


def test_level_is_that_of_the_library_in_use(ready: Any, tmp_path: Path) -> None:
    assert ready.kernel().level() in ("x86-64-v4", "x86-64-v3", "x86-64-v2", "generic", "apple-m1")
    assert Kernel(ready.source, tmp_path / "nowhere").level() == ""


def test_whoever_is_interrupted_at_any_line_leaves_the_kernel_to_the_next_call_of_any_thread(
    ready: Any,
) -> None:
    class Interrupted(Exception):
        pass

    file, line, reached = Kernel.load.__code__.co_filename, 0, True
    while reached:
        kernel, line, left = ready.kernel(), line + 1, [line + 1]

        def follow(frame: Any, event: str, arg: Any, left: list[int] = left) -> Any:
            if frame.f_code.co_filename == file and event == "line":
                left[0] -= 1
                if left[0] == 0:
                    raise Interrupted
            return follow

        before = sys.gettrace()
        sys.settrace(follow)
        try:
            kernel.load(ready.summed)
            reached = False
        except Interrupted:
            pass
        finally:
            sys.settrace(before)
        found: list[Any] = []
        other = threading.Thread(
            target=lambda k=kernel, out=found: out.append(k.load(ready.summed)), daemon=True
        )
        other.start()
        other.join(10.0)
        assert found and isinstance(found[0], type(len)), f"after line {line}"
    assert line > 8
