"""Whether the kernel is being built in this process, or must run as plain Python."""

import os
import sys
from pathlib import Path

KERNEL = Path(__file__).resolve().parents[1]
"""The folder of the kernel's source."""

SWITCH = "FTQP_BUILD_KERNEL"
"""The environment variable that, set to 1, has helpers compiled by numba; the builder sets it for itself."""

BUILDING = os.environ.get(SWITCH) == "1"
"""Whether the formulas are written for numba in this process."""

PLAIN = (
    os.environ.get("NUMBA_DISABLE_JIT", "0").strip() not in ("", "0") or sys.implementation.name != "cpython"
)
"""Whether the kernel must run as plain Python: asked for by ``NUMBA_DISABLE_JIT=1``, or no CPython."""
