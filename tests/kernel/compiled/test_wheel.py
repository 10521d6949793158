import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ftqp.kernel.compiled import wheel
from ftqp.kernel.compiled.mode import COMPILED, source_key

USE = """
import sys
import numpy as np
from pathlib import Path
from ftqp.kernel.compiled.entry_point import EntryPoint
from ftqp.kernel.compiled.kernel import Kernel
summed = EntryPoint(name="summed", module={module!r}, factory="summed", signature="ii")
taken = EntryPoint(name="taken", module={module!r}, factory="taken", signature="oii")
kernel = Kernel(Path({source!r}), Path({ahead!r}))
record = np.append(np.linspace(-2.0, 3.0, 8), 0.0)
assert kernel.missing([(summed, 8), (taken, 8)]) == {missing}
assert kernel.load(summed, 8)(record.ctypes.data, 8) == 16
out = np.zeros(9)
assert kernel.load(taken, 8)(record, out.ctypes.data, 9) == 9
assert (out == record).all()
try:
    kernel.load(summed, 8)(1)
except TypeError:
    print(record[8].hex(), "numba" in sys.modules, "llvmlite" in sys.modules)
"""


def said(tiny: Any, ahead: Path, missing: str, **environment: str) -> list[str]:
    program = USE.format(module=tiny.module, source=str(tiny.source), ahead=str(ahead), missing=missing)
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(tiny.source), *sys.path])} | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.slow
@pytest.mark.skipif(not COMPILED, reason="the kernel runs as plain Python")
def test_library_gives_the_bits_of_compiling_for_its_processor_without_numba(
    tiny: Any, tmp_path: Path
) -> None:
    from ftqp.kernel.compiled.machine_code import linked_function
    from ftqp.kernel.compiled.making.emit import object_code
    from ftqp.kernel.compiled.making.library import BASELINES, build_library
    from ftqp.kernel.compiled.making.processor import baseline

    ahead = tmp_path / "ahead"
    build_library(ahead, [(tiny.summed, 8), (tiny.entry("taken", "oii"), 8)], tiny.source)
    manifest = json.loads((ahead / wheel.MANIFEST).read_text())
    cpu, _ = BASELINES[manifest["machine"]]
    assert manifest["cpu"] == cpu
    code = object_code(
        tiny.summed.function(8),
        symbol="summed",
        signature="ii",
        nogil=False,
        target=baseline(cpu),
        capacity=8,
    )
    record = np.append(np.linspace(-2.0, 3.0, 8), 0.0)
    function = linked_function(code, "summed")
    assert function is not None and function(record.ctypes.data, 8) == 16
    assert said(tiny, ahead, "[]") == [float(record[8]).hex(), "False", "False"]
    everything = "[(summed, 8), (taken, 8)]"
    assert said(tiny, ahead, everything, FTQP_NO_WHEEL_KERNEL="1")[1:] == ["True", "True"]
    (tiny.source / "beside.py").write_text("changed = True\n")
    assert said(tiny, ahead, everything)[1:] == ["True", "True"]


@pytest.mark.parametrize(
    "change",
    [{"source": "another"}, {"system": "Plan9"}, {"machine": "vax"}, {"format": 0}, {"entries": None}, {}],
)
def test_library_that_does_not_fit_or_is_missing_is_not_used(tmp_path: Path, change: dict[str, Any]) -> None:
    manifest = {**wheel.platform_facts(), "source": "key", "entries": {}, **change}
    (tmp_path / wheel.MANIFEST).write_text(json.dumps(manifest))
    assert wheel.library_of(tmp_path, "key") is None
    (tmp_path / wheel.LIBRARY).write_bytes(b"no library")
    assert wheel.library_of(tmp_path, "key") is None


@pytest.mark.parametrize("text", ["", "[]", "{", "null", '{"entries": []}', "\x00"])
def test_broken_manifest_is_not_used(tmp_path: Path, text: str) -> None:
    (tmp_path / wheel.MANIFEST).write_text(text)
    assert wheel.library_of(tmp_path, "key") is None


def test_source_key_sees_every_file_and_every_name(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("x = 1\n")
    keys = {source_key(tmp_path)}
    (tmp_path / "a.py").write_text("x = 2\n")
    keys.add(source_key(tmp_path))
    (tmp_path / "room").mkdir()
    (tmp_path / "room" / "b.py").touch()
    keys.add(source_key(tmp_path))
    (tmp_path / "room" / "b.py").rename(tmp_path / "b.py")
    keys.add(source_key(tmp_path))
    assert len(keys) == 4
