"""Builds a wheel that carries the kernel compiled ahead for a named class of processors.

    python build_wheel.py                  into dist/, with every entry point of the kernel

The code is made for the baseline of this machine's architecture (x86: x86-64-v3, so AVX2 and FMA). Where the
wheel is installed it is used if the platform, the processor and the source fit; else the kernel is compiled
as without it. The wheel is for this operating system, with the C library of this machine or a newer one.
"""

import argparse
import importlib
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from ftqp.kernel.compiled.making.library import build_library
from ftqp.kernel.compiled.mode import KERNEL

ROOT = Path(__file__).resolve().parent


def main() -> int:
    """Compiles, links, and has pip build the wheel; 0 when there is one."""
    summary, usage = (__doc__ or "").split("\n\n", 1)
    parser = argparse.ArgumentParser(
        description=summary, epilog=usage, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=ROOT / "dist", metavar="DIR", help="where the wheel goes")
    parser.add_argument(
        "--entries",
        default="ftqp.kernel.entry.table:AHEAD",
        metavar="MODULE:NAME",
        help="a sequence of pairs: entry point, capacity (default %(default)s)",
    )
    options = parser.parse_args()
    module, name = options.entries.split(":")
    wanted = getattr(importlib.import_module(module), name)
    with tempfile.TemporaryDirectory() as folder:
        build_library(Path(folder), wanted, KERNEL)
        command = [
            sys.executable,
            "-m",
            "pip",
            "wheel",
            "--disable-pip-version-check",
            "--quiet",
            "--no-deps",
        ]
        done = subprocess.run(
            [*command, "--wheel-dir", str(options.out), str(ROOT)],
            env=os.environ | {"FTQP_KERNEL_AHEAD": folder},
            check=False,
        )
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())
