"""Whether the kernel runs compiled, and the hash of the source that the compiled code belongs to."""

import hashlib
import importlib.util
import os
import re
import sys
from functools import cache
from pathlib import Path

KERNEL = Path(__file__).resolve().parents[1]
"""The folder of the kernel's source."""


def _asked_for_plain_python() -> bool:
    return os.environ.get("NUMBA_DISABLE_JIT", "0").strip() not in ("", "0")


NUMBA = importlib.util.find_spec("numba") is not None and importlib.util.find_spec("llvmlite") is not None
"""Whether numba and llvmlite are installed; neither is imported to find out."""

PLAIN = _asked_for_plain_python() or sys.implementation.name != "cpython"
"""Whether the kernel must run as plain Python: asked for by ``NUMBA_DISABLE_JIT=1``, or no CPython."""

COMPILED = NUMBA and not PLAIN
"""Whether the kernel can be compiled in this process."""


def source_key(package: Path) -> str:
    """A hash of every source file of a package, in hexadecimal: a change in any of them compiles anew."""
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        content = path.read_bytes()
        digest.update(f"{path.relative_to(package).as_posix()}\0{len(content)}\0".encode())
        digest.update(content)
    return digest.hexdigest()[:16]


@cache
def version_of(package: str) -> str:
    """The version of numba or llvmlite, read from its files without an import; empty where it is unknown."""
    spec = importlib.util.find_spec(package)
    if spec is None or spec.origin is None:
        return ""
    try:
        text = (Path(spec.origin).parent / "_version.py").read_text(encoding="utf-8")
    except OSError:
        text = ""
    found = re.search(r"""["']?version["']?\s*[:=]\s*["']([^"']+)["']""", text)
    if found is not None:
        return found.group(1)
    from importlib import metadata

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""


def python_tag() -> str:
    """The interpreter whose C functions the compiled code calls, for example ``cpython-311``."""
    return sys.implementation.cache_tag or f"python-{sys.version_info[0]}{sys.version_info[1]}"
