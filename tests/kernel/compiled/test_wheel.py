import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ftqp.kernel.compiled import wheel
from ftqp.kernel.compiled.kernel import Kernel
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
def test_broken_manifest_is_not_used(tmp_path: Path, text: str, log: pytest.LogCaptureFixture) -> None:
    (tmp_path / wheel.MANIFEST).write_text(text)
    assert wheel.library_of(tmp_path, "key") is None
    assert [f"{wheel.MANIFEST} is damaged" in said for said in log.messages] == [True]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A library that fits this machine, and its manifest."""
    if shutil.which("cc") is None:
        pytest.skip("needs a C compiler: apt install gcc")
    folder = tmp_path_factory.mktemp("ahead")
    (folder / "fits.c").write_text("int ftqp_fits(void) { return 1; }\n")
    subprocess.run(
        ["cc", "-shared", "-fPIC", "-o", str(folder / wheel.LIBRARY), str(folder / "fits.c")], check=True
    )
    mark = wheel.fingerprint((folder / wheel.LIBRARY).read_bytes())
    manifest = {**wheel.platform_facts(), "source": "key", "entries": {}, "sha256": mark}
    (folder / wheel.MANIFEST).write_text(json.dumps(manifest))
    return folder


@pytest.fixture
def ahead(built: Path, tmp_path: Path) -> Path:
    """A copy of them that a test may damage."""
    return Path(shutil.copytree(built, tmp_path / "ahead"))


def test_whole_library_of_ours_is_loaded_without_a_word(ahead: Path, log: pytest.LogCaptureFixture) -> None:
    assert wheel.library_of(ahead, "key") is not None
    assert log.messages == []


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("damage", ["cut", "flip"])
def test_damaged_library_is_not_loaded(
    ahead: Path, damage: str, share: float, log: pytest.LogCaptureFixture
) -> None:
    library = ahead / wheel.LIBRARY
    content = bytearray(library.read_bytes())
    at = min(int(share * len(content)), len(content) - 1)
    if damage == "cut":
        del content[at:]
    else:
        content[at] ^= 1
    library.write_bytes(content)
    assert wheel.library_of(ahead, "key") is None
    assert len(log.messages) == 1
    assert f"{library} is not what manifest.json says it is" in log.messages[0]
    assert "the kernel is compiled anew" in log.messages[0]


@pytest.mark.parametrize("mark", [None, "", 5, "0" * 64])
def test_library_whose_manifest_has_another_hash_or_none_is_not_loaded(
    ahead: Path, mark: object, log: pytest.LogCaptureFixture
) -> None:
    manifest = json.loads((ahead / wheel.MANIFEST).read_text())
    (ahead / wheel.MANIFEST).write_text(json.dumps(manifest | {"sha256": mark}))
    assert wheel.library_of(ahead, "key") is None
    assert len(log.messages) == 1 and "its sha256 differs" in log.messages[0]


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="no users as on POSIX")
@pytest.mark.parametrize("name", [wheel.LIBRARY, wheel.MANIFEST, "."])
def test_library_that_others_could_write_is_not_loaded(
    ahead: Path, name: str, log: pytest.LogCaptureFixture
) -> None:
    place = ahead / name
    place.chmod(place.stat().st_mode | 0o002)
    assert wheel.library_of(ahead, "key") is None
    assert [f"{place} can be written by other users" in said for said in log.messages] == [True]


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root gives files away")
def test_library_of_another_user_is_not_loaded(ahead: Path, log: pytest.LogCaptureFixture) -> None:
    os.chown(ahead / wheel.LIBRARY, 65534, 65534)
    assert wheel.library_of(ahead, "key") is None
    assert ["belongs to another user" in said for said in log.messages] == [True]


@pytest.mark.skipif(not COMPILED, reason="the kernel runs as plain Python")
def test_kernel_is_compiled_where_its_library_is_damaged(
    tiny: Any, ahead: Path, log: pytest.LogCaptureFixture
) -> None:
    with (ahead / wheel.LIBRARY).open("r+b") as file:
        file.truncate(100)
    manifest = json.loads((ahead / wheel.MANIFEST).read_text())
    manifest["source"] = source_key(tiny.source)
    (ahead / wheel.MANIFEST).write_text(json.dumps(manifest))
    kernel = Kernel(tiny.source, ahead)
    record = np.append(np.linspace(-2.0, 3.0, 8), 0.0)
    assert kernel.load(tiny.summed, 8)(record.ctypes.data, 8) == 16
    assert len(log.messages) == 1 and "its sha256 differs" in log.messages[0]


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
