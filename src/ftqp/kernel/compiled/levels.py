"""Classes of processors that the kernel is built for, and the best one that this machine belongs to."""

import platform
from typing import Any, Final

LEVELS: Final[dict[str, dict[str, tuple[str, ...]]]] = {
    "x86_64": {
        "x86-64-v4": ("AVX2", "FMA3", "F16C", "AVX512F", "AVX512CD", "AVX512BW", "AVX512DQ", "AVX512VL"),
        "x86-64-v3": ("AVX2", "FMA3", "F16C"),
        "x86-64-v2": ("SSE42", "POPCNT"),
    },
    "aarch64": {"generic": ()},
    "arm64": {"apple-m1": ()},
}
"""For each architecture the classes by LLVM's name, the best first, with what numpy calls their features."""
LEVELS["AMD64"] = LEVELS["x86_64"]


def _features() -> dict[str, Any]:
    """What this processor has, as numpy finds it when it is imported."""
    try:
        from numpy._core._multiarray_umath import (  # type: ignore[import-not-found]
            __cpu_features__ as found,
        )
    except ImportError:
        return {}
    return dict(found)


def level_here() -> str | None:
    """The best class that this machine belongs to; ``None`` where there is none."""
    return next((name for name in LEVELS.get(platform.machine(), {}) if belongs(name)), None)


def belongs(level: str) -> bool:
    """Whether this machine belongs to a class."""
    wanted, found = LEVELS.get(platform.machine(), {}).get(level), _features()
    return wanted is not None and all(found.get(name, False) for name in wanted)
