"""Building: what an edit compiles anew, and what is left when it is interrupted, raced or impossible."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep

import pytest

import ftqp
from ftqp.kernel.compiled.library import MANIFEST, library_in

pytest.importorskip("numba")
SOURCE = Path(ftqp.__file__).parents[1]


def edited(tiny, old, new):
    text = tiny.text.read_text()
    assert old in text
    tiny.text.write_text(text.replace(old, new))


def test_edit_compiles_what_depends_on_it_and_a_comment_nothing(tiny):
    wanted = (tiny.summed, tiny.entry("fails", "i"))
    assert tiny.build(*wanted) == 3, "two entry points and a part"
    edited(tiny, "# of growing size", "# that grows")
    edited(tiny, "A wave.", "One wave, and no other.")
    assert tiny.build(*wanted) == 0
    assert library_in(tiny.built, tiny.source)
    edited(tiny, "return count + joints", "return joints + count")
    assert tiny.build(*wanted) == 1, "the entry point, not the part that it calls"
    edited(tiny, "x / 3.0", "x / 4.0")
    assert tiny.build(*wanted) == 1, "the part with the helper in it, not the entry point that calls it"
    assert len(list(tiny.built.glob("*.so"))) == 1


@pytest.mark.slow
def test_two_builds_at_once_leave_a_whole_library(tiny):
    both = [tiny.building(tiny.summed) for _ in range(2)]
    said = [process.communicate() for process in both]
    assert [process.returncode for process in both] == [0, 0], said
    assert sorted(int(out) for out, _ in said) == [0, 2], "the second one finds what the first one compiled"
    assert library_in(tiny.built, tiny.source)


@pytest.mark.slow
def test_interrupted_build_leaves_the_library_as_it_was(tiny):
    tiny.build(tiny.summed)
    before = {path.name: path.read_bytes() for path in tiny.built.iterdir()}
    edited(tiny, "x / 3.0", "x / 4.0")
    process, began = tiny.building(tiny.summed, tiny.entry("fails", "i")), monotonic()
    store = tiny.source.parent / "store"
    count = len(list(store.iterdir()))
    while len(list(store.iterdir())) == count and monotonic() < began + 60.0:
        sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)
    process.communicate()
    assert process.returncode != 0
    assert {path.name: path.read_bytes() for path in tiny.built.iterdir()} == before
    assert not list(tiny.built.glob(".*"))


def test_code_that_allocates_is_refused(tiny):
    process = tiny.building(tiny.entry("allocates", "i"))
    _, said = process.communicate()
    assert process.returncode == 1 and "entry points allocate nothing" in said
    assert not (tiny.built / MANIFEST).exists()


@pytest.mark.parametrize(
    ("hidden", "reason"),
    [
        ("sys.modules['numba'] = None", "building needs numba and llvmlite"),
        ("from numba.core import ir; del ir.Inst._rec_list_vars", "building needs numba and llvmlite"),
        ("import platform; platform.machine = lambda: 'm68k'", "no class of processors is named for m68k"),
        ("from ftqp.kernel.entry import table; table.PARTS['first'] = table.PARTS['first'][:1];"
         "import platform; platform.system = lambda: 'Windows'", "nothing links it on Windows"),
        ("from ftqp.kernel.entry import table; table.PARTS['first'] = table.PARTS['first'][:1];"
         "sys.modules['ziglang'] = None; import os; os.environ['PATH'] = ''",
         "neither ziglang nor cc is here"),
    ],
)  # fmt: skip
def test_machine_that_cannot_build_gets_plain_python_and_the_reason(tmp_path, hidden, reason):
    code = (
        f"import sys; {hidden}\n"
        "from ftqp.kernel.building.__main__ import main\n"
        f"sys.exit(main(['--part', 'first', '--out', {str(tmp_path / 'out')!r}, "
        f"'--store', {str(tmp_path / 's')!r}]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(SOURCE)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1, done.stderr
    (line,) = done.stderr.splitlines()
    assert line.startswith("the kernel is not built: ") and reason in line
    text = (tmp_path / "out" / MANIFEST).read_text()
    assert reason in text and "Traceback" not in done.stderr


def test_folder_that_cannot_be_written_costs_one_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    done = subprocess.run(
        [sys.executable, "-m", "ftqp.kernel.building", "--part", "first",
         "--out", str(tmp_path / "file" / "out"), "--store", str(tmp_path / "file" / "store")],
        env={**os.environ, "PYTHONPATH": str(SOURCE)},
        capture_output=True,
        text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert done.stderr.startswith("the kernel is not built: ") and done.stderr.count("\n") == 1
