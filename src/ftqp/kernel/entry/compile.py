"""Machine code of the entry points, made or loaded when it is first needed."""

import importlib
from collections.abc import Callable
from functools import cache

from ftqp.kernel.entry.table import Entry


@cache
def load(entry: Entry, capacity: int) -> Callable[..., int]:
    from ftqp.kernel.jit import COMPILED

    f = getattr(importlib.import_module(entry.module), entry.name)(capacity)
    if not COMPILED:
        return f
    import numba

    from ftqp.kernel.jit import FAST

    d = numba.njit(error_model="numpy", fastmath=FAST)(f)
    d.compile((numba.int64,) * len(entry.arguments))
    d.disable_compile()
    ep = list(d.overloads.values())[0].entry_point
    kinds = entry.arguments
    if "o" not in kinds:
        return ep

    def call(*a):
        return ep(*(id(x) if k == "o" else x for k, x in zip(kinds, a)))

    return call


def compile_entries(entries, capacity, announce=None):
    for e in entries:
        load(e, capacity)
