"""``python -m ftqp.kernel.building.deployed`` compiles the planner's kernel for programs in C and links it.

The units are those of the library that Python loads, by the same emitter, and for the processor of this
machine the same object files; beside them lie a few entry points that C calls, and the C interface itself. It
prints how many units it has compiled and, last, what it made, each as a JSON object in a line. ``ftqp build``
runs it in a process of its own, because formulas are written for numba there.
"""

import argparse
import importlib.util
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from ftqp.core.extras import remedy_for_extra
from ftqp.kernel.building.wheel_targets import BuildTarget, CannotBuild
from ftqp.kernel.compiled import library
from ftqp.kernel.compiled.library import KERNEL, LEVELS
from ftqp.kernel.layout.enums import JOINTS

ROOT = KERNEL.parents[2]
WASM_STACK = 1 << 18
"""Stack of a planner in a browser [bytes]: thirty times what `benchmarks/bench_deployed.py` measures."""


def platforms() -> dict[str, BuildTarget]:
    """What can be built for, by the name that the user gives."""
    here = {"x86_64": "x86_64-linux-gnu", "AMD64": "x86_64-linux-gnu", "aarch64": "aarch64-linux-gnu"}
    own = here.get(platform.machine(), "x86_64-linux-gnu")
    host = "aarch64-macos" if sys.platform == "darwin" else own
    return {
        "host": BuildTarget(None, host),
        "x86-64-v3": BuildTarget("x86_64-unknown-linux-gnu", "x86_64-linux-gnu", cpu="x86-64-v3"),
        "aarch64": BuildTarget("aarch64-unknown-linux-gnu", "aarch64-linux-gnu", cpu="cortex-a72"),
        "wasm32": BuildTarget("wasm32-unknown-wasi", "wasm32-wasi", cpu="generic"),
    }


def store_folder() -> Path:
    """Where object files are kept: beside the source, or in the user's cache where ftqp is installed."""
    if (ROOT / "pyproject.toml").is_file():
        return ROOT / "build" / "kernel"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ftqp" / "kernel"


WARNINGS: Final = ("-std=c11", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic")


def main(arguments: Sequence[str] | None = None) -> int:
    """Build it: 0 and what was made on stdout, or 1 and a sentence on stderr."""
    parser = argparse.ArgumentParser(prog="python -m ftqp.kernel.building.deployed", description=__doc__)
    add = parser.add_argument
    add("--target", required=True, choices=platforms())
    add("--cpu", default=None, help="a processor by LLVM's name, in place of the target's class")
    add("--source", type=Path, required=True, help="the folder of ftqp.c and ftqp.h")
    add("--layout", type=Path, required=True, help="the folder of layout.h")
    add("--out", type=Path, required=True, help="the folder of the library")
    add("--path", action="store_true", help="a library with a path")
    add("--joints", type=int, default=JOINTS, help="most joints of an arm, as the layout has it")
    add("--jobs", type=int, default=os.cpu_count())
    given = parser.parse_args(arguments)
    library.BUILDING = True  # before the formulas are imported
    try:
        from ftqp.kernel.building.store import Store
    except (ImportError, AttributeError) as error:  # none, or one that is made otherwise inside
        return _report_failure(f"building needs numba and ziglang ({error}); {remedy_for_extra('build')}")
    try:
        made = _built(given, Store(store_folder()))
    except (CannotBuild, LookupError, OSError) as error:
        return _report_failure(str(error))
    sys.stdout.write(json.dumps(made) + "\n")
    return 0


def _say_progress(compiled: int, known: int) -> None:
    """A line for who runs this."""
    sys.stdout.write(json.dumps({"compiled": compiled, "known": known}) + "\n")
    sys.stdout.flush()


def _report_failure(reason: str) -> int:
    sys.stderr.write(f"{reason}\n")
    return 1


def _built(given: argparse.Namespace, store: Any) -> dict[str, Any]:
    from ftqp.kernel.building.store import compiled
    from ftqp.kernel.compiled.making.emit import Target, target
    from ftqp.kernel.entry.table import DEPLOYED, FOLLOWING

    if importlib.util.find_spec("ziglang") is None:
        raise CannotBuild(f"linking needs ziglang; {remedy_for_extra('build')}")
    wanted = platforms()[given.target]
    if wanted.triple is None:
        known = given.cpu is None or given.cpu in LEVELS.get(platform.machine(), ())
        processor = target(given.cpu) if known else Target(target().triple, given.cpu)
    else:
        processor = Target(wanted.triple, given.cpu or wanted.cpu)
        own = target()
        if processor.cpu == own.cpu and not processor.is_foreign:
            processor = own  # of the same object files
    if given.cpu is not None:
        _refuse_unknown(given.cpu, given.target, wanted)
    with store.alone():
        entries = DEPLOYED + (FOLLOWING if given.path else ())
        keys, count = compiled(entries, processor, store, given.jobs, given.joints, _say_progress)
    given.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        objects = [str(store.object_file(key)) for key in keys.values()]
        glue = str(Path(folder) / "ftqp.o")
        shared = [] if given.target == "wasm32" else ["-fPIC", "-fvisibility=hidden"]
        include = [f"-I{given.source}", f"-I{given.layout}"]
        has = [f"WITH_{name.upper()}" for name in ("path",) if getattr(given, name)]
        has += [f"LEVEL={level}" for level in (3, 4) if processor.cpu == f"x86-64-v{level}"]
        _zig(
            "cc", "-target", wanted.zig, *WARNINGS, *(f"-DFTQP_{name}" for name in has), *shared,
            *include, "-c", given.source / "ftqp.c", "-o", glue,
        )  # fmt: skip
        files = _linked(given, wanted, [glue, *objects])
    return {
        "files": files, "units": len(keys), "compiled": count,
        "triple": processor.triple, "cpu": processor.cpu,
        "zig": _zig("version").strip(), "store": str(store_folder()),
    }  # fmt: skip


def _refuse_unknown(cpu: str, name: str, wanted: BuildTarget) -> None:
    """Refuse a processor that the target's architecture does not have; zig writes names with underscores."""
    with tempfile.TemporaryDirectory() as folder:
        empty = Path(folder) / "empty.c"
        empty.write_text("int ftqp_nothing;\n", encoding="utf-8")
        try:
            mcpu = "-mcpu=" + cpu.replace("-", "_")
            _zig("cc", "-target", wanted.zig, mcpu, "-c", empty, "-o", Path(folder) / "empty.o")
        except CannotBuild:
            raise CannotBuild(
                f"{cpu!r} is no processor of {name} that LLVM knows; its names are like cortex-a76 or znver4"
            ) from None


def _linked(given: argparse.Namespace, wanted: BuildTarget, objects: list[str]) -> list[str]:
    """Write the libraries: their names."""
    if given.target == "wasm32":
        exports = [f"-Wl,--export={name}" for name in exported(given.source / "ftqp.h")]
        _zig(
            "cc", "-target", wanted.zig, "-O2", "-mexec-model=reactor", "-Wl,--no-entry", *exports,
            "-Wl,--export=__heap_base", "-Wl,-z", f"-Wl,stack-size={WASM_STACK}", "-Wl,--strip-all",
            "-o", given.out / "ftqp.wasm", *objects, "-lm",
        )  # fmt: skip
        return ["ftqp.wasm"]
    archive = given.out / "libftqp.a"
    archive.unlink(missing_ok=True)
    _zig("ar", "rcs", archive, *objects)
    name = "libftqp.dylib" if "macos" in wanted.zig else "libftqp.so"
    _zig("cc", "-target", wanted.zig, "-shared", "-o", given.out / name, *objects, "-lm", "-s")
    return ["libftqp.a", name]


def exported(header: Path) -> list[str]:
    """Names of the functions that a header declares."""
    text = re.sub(r"/\*.*?\*/", "", header.read_text(encoding="utf-8"), flags=re.S)
    text = text.partition("static inline")[0]
    return sorted(
        set(re.findall(r"^(?:int|size_t|double|const double \*|const char \*)\s*(ftqp_\w+)\(", text, re.M))
    )


def _zig(*arguments: Any) -> str:
    """Run zig: what it printed."""
    command = [sys.executable, "-P", "-m", "ziglang", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise CannotBuild(f"zig {arguments[0]} failed: {done.stderr.strip()[-2000:]}")
    return done.stdout


if __name__ == "__main__":
    sys.exit(main())
