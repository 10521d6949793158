"""A library for another machine is what its file says, and its manifest and its wheel name that machine."""

import importlib.util
import json
import os
import re
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from ftqp.kernel.building.wheel_targets import TARGETS

ROOT = Path(__file__).parents[3]
PARTS = {"x86_64-linux": 0x3E, "aarch64-linux": 0xB7}
"""Machines as the head of an ELF file has them."""


def hook():
    """The module ``hatch_build.py``."""
    pytest.importorskip("hatchling", reason="building wheels needs hatchling")
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def macos_of(library):
    """The processor of a Mach-O library, and the oldest version of the system that it wants."""
    magic, processor, _, _, commands = struct.unpack_from("<5I", library)
    assert magic == 0xFEEDFACF
    place = 32
    for _ in range(commands):
        command, size = struct.unpack_from("<2I", library, place)
        if command == 0x32:  # LC_BUILD_VERSION: platform, then the version
            return processor, struct.unpack_from("<I", library, place + 12)[0] >> 16
        place += size
    raise AssertionError("no version of the system is named")


@pytest.mark.long
@pytest.mark.parametrize("target", TARGETS)
def test_a_library_for_another_machine_is_what_its_manifest_and_its_tag_say(tiny, target):
    assert tiny.build(tiny.summed, target=target) == 2
    manifest = json.loads((tiny.built / "manifest.json").read_bytes())
    (one,) = manifest["libraries"]
    library = (tiny.built / one["file"]).read_bytes()
    assert (manifest["system"], manifest["machine"]) == (TARGETS[target].system, TARGETS[target].machine)
    assert manifest["target"] == TARGETS[target].zig
    tag = hook().tag_of(manifest, target)
    if target == "aarch64-macos":
        assert macos_of(library) == (0x0100000C, 11)
        assert tag == "py3-none-macosx_11_0_arm64"
    else:
        assert library[:5] == b"\x7fELF\x02" and struct.unpack_from("<H", library, 18)[0] == PARTS[target]
        assert tag == f"py3-none-manylinux_2_17_{manifest['machine']}"


def test_a_library_that_only_this_machine_can_link_is_for_this_machine(monkeypatch):
    module = hook()
    assert module.target_here() in TARGETS
    monkeypatch.setattr(module.platform, "system", lambda: "Linux")
    monkeypatch.setattr(module.platform, "libc_ver", lambda: ("", ""))  # as on musl
    assert module.target_here() == ""
    monkeypatch.setattr(module.sysconfig, "get_platform", lambda: "linux-x86_64")
    assert module.tag_of({"system": "Linux", "machine": "x86_64"}, "") == "py3-none-linux_x86_64"


def test_an_unknown_target_is_refused_with_those_that_there_are():
    command = [sys.executable, "-m", "ftqp.kernel.building", "--target", "riscv64-linux"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and all(name in done.stderr for name in TARGETS)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of this machine, as ``make wheel`` makes it, for its own class of processors."""
    pytest.importorskip("hatchling", reason="building wheels needs hatchling")
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)]
    environment = {**os.environ, "GITHUB_REPOSITORY": "someone/ftqp", "FTQP_TARGET": "", "FTQP_LEVELS": ""}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (made,) = folder.glob("*.whl")
    return made


def test_make_builds_two_classes_of_processors_or_the_usual_one_of_a_target():
    def asked(*given):
        command = ["make", "-n", "wheel", *given]
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout

    assert "FTQP_TARGET= FTQP_LEVELS=x86-64-v4,x86-64-v3 " in asked("LEVELS=x86-64-v4,x86-64-v3")
    assert "FTQP_TARGET=aarch64-macos FTQP_LEVELS= " in asked("TARGET=aarch64-macos")


@pytest.mark.slow
def test_a_wheel_is_tagged_as_auditwheel_finds_it(wheel):
    pytest.importorskip("auditwheel", reason='needs the extra "dev": pip install -e ".[dev]"')
    command = [sys.executable, "-m", "auditwheel", "show", str(wheel)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found = re.search(r'tag: "manylinux_2_(\d+)_(\w+)"', " ".join(done.stdout.split()))
    assert found is not None and int(found[1]) <= 17, done.stdout
    assert wheel.name.endswith(f"-py3-none-manylinux_2_17_{found[2]}.whl")


@pytest.mark.slow
def test_a_wheel_has_its_description_and_tables_and_is_small(wheel):
    with zipfile.ZipFile(wheel) as held:
        (name,) = (one for one in held.namelist() if one.endswith(".dist-info/METADATA"))
        assert "Project-URL: Source, https://github.com/someone/ftqp\n" in held.read(name).decode()
        assert "ftqp/vendors/tables/feetech.toml" in held.namelist()
    assert wheel.stat().st_size < 10e6
