"""The built library: what is loaded, what is refused and why, how it is called and what arrays it takes."""

import json
import shutil
import sys
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ftqp.kernel.compiled.library import MANIFEST, Kernel, NoLibrary, fingerprint, library_in
from ftqp.kernel.jit import BAD_BUFFER, take
from ftqp.kernel.layout.enums import JOINTS

ROW = np.dtype([("x", np.float64, (JOINTS,)), ("sum", np.float64)])


def sum_of(function):
    """What the entry point ``summed`` makes of the numbers 0 to 4."""
    record = np.zeros(1, ROW)
    record["x"][0, :5] = np.arange(5.0)
    assert function(record.ctypes.data, 5) == 5 + JOINTS
    return float(record["sum"][0])


def expected():
    x = np.arange(5.0)
    return float((np.sin(x) * np.sqrt(x + 1.0) + x / 3.0).sum())


def test_built_function_computes_its_formula(ready, log):
    function = ready.kernel().load(ready.summed)
    assert isinstance(function, type(len)) and not log.messages
    assert sum_of(function) == pytest.approx(expected(), rel=1e-15)


def test_plain_python_does_what_is_not_built_and_one_sentence_says_so(tiny, log):
    kernel = tiny.kernel()
    assert sum_of(kernel.load(tiny.summed)) == pytest.approx(expected(), rel=1e-15)
    (said,) = log.messages
    assert said.startswith("the kernel is not built; plain Python does its work") and "make kernel" in said


def test_entry_point_that_the_library_lacks_is_plain_python_and_named(ready, log):
    kernel = ready.kernel()
    entry = ready.entry("fails", "i")
    assert kernel.load(entry)(7) == 7
    assert not isinstance(kernel.load(ready.entry("summed", "iii")), type(len)), "of another signature"
    (said,) = log.messages
    assert "the built kernel has no" in said


def test_wrong_arguments_are_errors_of_the_caller(ready):
    function = ready.kernel().load(ready.summed)
    for arguments in ((), (1,), (1, 2, 3)):
        with pytest.raises(TypeError, match="ftqp_summed takes 2 arguments"):
            function(*arguments)
    with pytest.raises(TypeError, match="integer"):
        function("address", 1)
    with pytest.raises(OverflowError):
        function(2**80, 1)


def test_error_in_compiled_code_is_an_exception(ready):
    function = ready.kernel().load(ready.entry("fails", "i"))
    assert function(3) == 3
    with pytest.raises(RuntimeError, match="ftqp_fails failed in compiled code"):
        function(1)


def test_other_python_threads_run_beside_an_entry_point_that_releases_the_interpreter(ready):
    flag = np.zeros(1)
    function = ready.kernel().load(ready.entry("waiting", "ii", nogil=True))
    timer = threading.Timer(0.05, lambda: flag.fill(1.0))
    timer.start()
    assert function(flag.ctypes.data, 10**9) == 1
    timer.join()


def test_level_is_that_of_the_library_in_use(ready, tmp_path):
    assert ready.kernel().level() in ("x86-64-v4", "x86-64-v3", "x86-64-v2", "generic", "apple-m1")
    assert Kernel(ready.source, tmp_path / "nowhere").level() == ""


def test_whoever_is_interrupted_at_any_line_leaves_the_kernel_to_the_next_call_of_any_thread(ready):
    class Interrupted(Exception):
        pass

    file, line, reached = Kernel.load.__code__.co_filename, 0, True
    while reached:
        kernel, line, left = ready.kernel(), line + 1, [line + 1]

        def follow(frame, event, arg, left=left):
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
        found = []
        other = threading.Thread(
            target=lambda k=kernel, out=found: out.append(k.load(ready.summed)), daemon=True
        )
        other.start()
        other.join(10.0)
        assert found and isinstance(found[0], type(len)), f"after line {line}"
    assert line > 8


@pytest.fixture
def copy(ready, tmp_path):
    """A copy of the built library and of its source."""
    built, source = tmp_path / "built", tmp_path / "source"
    shutil.copytree(ready.built, built)
    shutil.copytree(ready.source, source, ignore=shutil.ignore_patterns("__pycache__"))
    return built, source


def problem(copy):
    """Why it is not loaded."""
    with pytest.raises(NoLibrary) as caught:
        library_in(*copy)
    return str(caught.value)


def said(built, **changes):
    """Change the manifest; names with two underscores are those of its library."""
    manifest = json.loads((built / MANIFEST).read_text())
    for name, value in changes.items():
        (manifest["libraries"][0] if name.startswith("of_") else manifest)[name.removeprefix("of_")] = value
    (built / MANIFEST).write_text(json.dumps(manifest))


def library(built):
    """The file of the library."""
    (one,) = built.glob("kernel-*.so")
    return one


def test_whole_library_is_loaded(copy):
    assert library_in(*copy).level


def test_no_folder_is_a_kernel_that_is_not_built(tmp_path):
    assert problem((tmp_path / "none", tmp_path)) == "the kernel is not built"


def test_library_that_is_older_than_its_source_is_not_loaded(copy):
    (file,) = copy[1].glob("*.py")
    file.write_text(file.read_text().replace("x / 3.0", "x / 4.0"))
    assert "is older than its source" in problem(copy)
    said(copy[0], files="")  # as in a wheel, where nobody edits
    assert library_in(*copy)


def test_library_that_is_older_than_its_c_is_not_loaded(copy):
    (copy[1] / "glue.c").write_text("int more;\n")
    assert "is older than its source" in problem(copy)


def test_comments_and_docstrings_make_no_library_older(copy):
    (file,) = copy[1].glob("*.py")
    text = file.read_text()
    file.write_text(text.replace("# of growing size", "#").replace("A wave.", "One wave.") + "# end\n")
    assert library_in(*copy)


def flipped(content):
    """The same with one bit of another value."""
    half = len(content) // 2
    return content[:half] + bytes([content[half] ^ 1]) + content[half + 1 :]


def of_text(built):
    """A file that is no machine code, and a manifest that says that it is as it should be."""
    library(built).write_bytes(b"no machine code")
    said(built, of_sha256=fingerprint(b"no machine code"))


OTHERS = ({"format": 1}, {"system": "Plan9"}, {"machine": "m68k"}, {"implementation": "pypy"}, {"pointer": 4})
TEXTS = ("", "{", "null", "{}", "[" * 100_000, '{"libraries": [{}]}', '{"libraries": 3}', "\x00\xff")
OUTSIDE = ("../kernel.so", "/kernel.so", "", "sub/kernel.so")
WRONG = [
    *((lambda built, change=change: said(built, **change), "was built for") for change in OTHERS),
    (lambda built: said(built, of_level="x86-64-v9"), "this processor does not have all that"),
    *((lambda b, text=text: (b / MANIFEST).write_text(text), f"{MANIFEST} is damaged") for text in TEXTS),
    *((lambda built, file=file: said(built, of_file=file), f"{MANIFEST} is damaged") for file in OUTSIDE),
    (lambda built: library(built).write_bytes(b""), "its sha256 differs"),
    (lambda built: library(built).write_bytes(library(built).read_bytes()[:-99]), "its sha256 differs"),
    (lambda built: library(built).write_bytes(flipped(library(built).read_bytes())), "its sha256 differs"),
    (of_text, "cannot be loaded"),
    (lambda built: library(built).unlink(), "cannot be read"),
    (
        lambda built: said(built, libraries=[], reason="no linker"),
        "the kernel could not be built (no linker)",
    ),
]


@pytest.mark.parametrize(("spoil", "reason"), WRONG, ids=range(len(WRONG)))
def test_library_that_is_not_what_it_should_be_is_not_loaded(copy, spoil, reason):
    spoil(copy[0])
    assert reason in problem(copy)


ROOM = 12


@pytest.fixture(scope="module", params=["plain", "built"])
def taken(request, ready):
    """What take returns, and the numbers that it wrote; twice the room was there."""
    entry = ready.entry("taken", "oiiii")
    call = take if request.param == "plain" else ready.kernel().load(entry)

    def taken(source, count=ROOM, first=0, dimensions=0):
        out = np.full(2 * ROOM, np.nan)
        found = int(call(source, first, out.ctypes.data, count, dimensions))
        written = out[~np.isnan(out)]
        assert np.isnan(out[len(written) :]).all()
        return found, written.tolist()

    return taken


@settings(deadline=None)  # the first call compiles
@given(st.lists(st.floats(allow_nan=False), max_size=2 * ROOM))
def test_numbers_are_copied_bit_by_bit_as_far_as_there_is_room(taken, numbers):
    assert taken(np.array(numbers, dtype=float)) == (len(numbers), numbers[:ROOM])


def test_numbers_are_taken_from_the_first_one_asked_for(taken):
    A = np.arange(12.0).reshape(3, 4)
    for source in (A, memoryview(A)):
        assert taken(source, 4, first=4) == (8, [4.0, 5.0, 6.0, 7.0])
        assert taken(source, 4, first=10) == (2, [10.0, 11.0])
        assert taken(source, 4, first=12) == taken(source, 4, first=99) == (0, [])


def test_another_number_of_dimensions_is_refused(taken):
    A = np.arange(16.0)
    for source in (A, A.reshape(4, 4), memoryview(A), memoryview(A.reshape(4, 4))):
        assert taken(source, dimensions=np.ndim(source))[0] == 16
        assert taken(source, dimensions=3 - np.ndim(source)) == (BAD_BUFFER, [])


def test_what_is_no_contiguous_float64_is_refused(taken):
    A = np.arange(12.0).reshape(3, 4)
    for source in (
        A.T,
        A[:, 1],
        A.ravel()[::2],
        A.ravel()[::-1],
        A.astype(">f8"),
        A.astype(np.float32),
        A.astype(np.int64),
        A.astype(np.complex128),
        A.astype(object),
        A.view([("x", float), ("y", float)]),
        np.array(3.0),
        np.float64(3.0),
        np.array(["2020-01-01"], dtype="M8[s]"),
        [1.0, 2.0],
        (1.0,),
        3.0,
        7,
        None,
        "12345678",
        b"12345678",
        object(),
        memoryview(A)[::2],
    ):
        assert taken(source) == (BAD_BUFFER, [])
