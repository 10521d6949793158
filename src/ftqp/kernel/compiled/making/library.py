"""Builds the library of compiled code that a wheel carries. Used where the wheel is built, never after."""

import json
import platform
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path

from ftqp.kernel.compiled.entry_point import EntryPoint
from ftqp.kernel.compiled.making.emit import object_code
from ftqp.kernel.compiled.making.processor import baseline
from ftqp.kernel.compiled.mode import source_key
from ftqp.kernel.compiled.wheel import FITS, LIBRARY, MANIFEST, fingerprint, platform_facts

BASELINES = {
    "x86_64": ("x86-64-v3", ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "popcnt")),
    "AMD64": ("x86-64-v3", ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "popcnt")),
    "aarch64": ("generic", ()),
    "arm64": ("apple-m1", ()),
}
"""For each architecture the processor that the code is made for, and the features to look for on arrival."""


def build_library(folder: Path, wanted: Iterable[tuple[EntryPoint, int]], source: Path) -> None:
    """Compile entry points for the named baseline of this architecture and link them into a library.

    Args:
        folder: where ``kernel.so`` and ``manifest.json`` go; it is made if it is missing.
        wanted: entry points with capacities.
        source: the folder with the Python source that they are compiled from.

    Raises:
        LookupError: if no baseline is named for this architecture.
        OSError: if the system has no C compiler ``cc``.
        subprocess.CalledProcessError: if the C compiler fails.
    """
    machine = platform.machine()
    if machine not in BASELINES:
        raise LookupError(f"no baseline is named for {machine}; there is one for {', '.join(BASELINES)}")
    cpu, features = BASELINES[machine]
    target = baseline(cpu)
    entries = {}
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as workshop:
        files = [Path(workshop) / "fits.c"]
        files[0].write_text(_fits(features))
        for entry, capacity in wanted:
            symbol = entry.symbol(capacity)
            entries[symbol] = [entry.signature, entry.nogil]
            files.append(Path(workshop) / f"{symbol}.o")
            files[-1].write_bytes(
                object_code(
                    entry.function(capacity),
                    symbol=symbol,
                    signature=entry.signature,
                    nogil=entry.nogil,
                    target=target,
                    capacity=capacity,
                )
            )
        undefined = ["-undefined", "dynamic_lookup"] if platform.system() == "Darwin" else []
        subprocess.run(
            [
                "cc",
                "-shared",
                "-fPIC",
                "-O2",
                *undefined,
                "-o",
                str(folder / LIBRARY),
                *map(str, files),
                "-lm",
            ],
            check=True,
        )
    manifest = {
        **platform_facts(),
        "cpu": cpu,
        "source": source_key(source),
        "sha256": fingerprint((folder / LIBRARY).read_bytes()),
        "entries": entries,
    }
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def _fits(features: tuple[str, ...]) -> str:
    """C source of the function that looks whether a processor has the features."""
    tests = "".join(f' && __builtin_cpu_supports("{name}")' for name in features)
    start = "__builtin_cpu_init();" if features else ""
    return f"int {FITS}(void) {{ {start} return 1{tests}; }}\n"
