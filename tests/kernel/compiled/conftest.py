"""A kernel of a few lines, written to a folder of its own, and the folder that its compiled code goes to."""

import logging
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from ftqp.kernel.compiled.entry_point import EntryPoint
from ftqp.kernel.compiled.kernel import Kernel

FORMULAS = """
import numpy as np

from ftqp.kernel.compiled.taking import take
from ftqp.kernel.jit import COMPILED, carray, jit, pointer

FLOAT = np.dtype(np.float64)

if COMPILED:
    from llvmlite import ir
    from numba import types
    from numba.core import cgutils
    from numba.extending import intrinsic

    @intrinsic
    def give_way(context):
        def code(context, builder, signature, arguments):
            kind = ir.FunctionType(ir.IntType(32), [])
            yield_now = cgutils.get_or_insert_function(builder.module, kind, "sched_yield")
            builder.call(yield_now, [])
            return context.get_dummy_value()

        return types.none(), code


@jit
def wave(x, k):
    return np.sin(x) * np.sqrt(k + 1.0) + x / 3.0


@jit
def total(X):
    s = 0.0
    for k in range(len(X)):
        s += wave(X[k], k)
    return s


def summed(capacity):
    row = np.dtype([("x", np.float64, (capacity,)), ("sum", np.float64)])

    def summed(address, count):
        record = carray(pointer(address), 1, row)[0]
        record.sum = total(record.x[:count])
        return count + capacity

    return summed


def taken(capacity):
    def taken(source, into, count):
        return take(source, 0, into, count, 0)

    return taken


def waiting(capacity):
    def waiting(flag_at, most):
        flag = carray(pointer(flag_at), 1, FLOAT)
        turns = 0
        while flag[0] == 0.0 and turns < most:
            turns += 1
            give_way()
        return 1 if flag[0] == 1.0 else 0

    return waiting


def fails(capacity):
    def fails(number):
        if number == 1:
            raise ValueError
        return number

    return fails
"""


@dataclass(frozen=True, slots=True)
class Tiny:
    """The little kernel.

    Attributes:
        source: the folder with its module.
        module: the module's name.
        cache: the folder of compiled code.
    """

    source: Path
    module: str
    cache: Path

    def entry(self, name: str, signature: str, *, nogil: bool = False) -> EntryPoint:
        """An entry point of it; its factory has the same name."""
        return EntryPoint(name=name, module=self.module, factory=name, signature=signature, nogil=nogil)

    @property
    def summed(self) -> EntryPoint:
        """The entry point that adds up."""
        return self.entry("summed", "ii")

    def kernel(self) -> Kernel:
        """A kernel that has loaded nothing yet."""
        return Kernel(self.source)

    def files(self) -> list[Path]:
        """The files of compiled code."""
        return sorted(self.cache.rglob("*.kernel"))


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Tiny]:
    module = "tiny_kernel_" + "".join(letter for letter in tmp_path.name if letter.isalnum())
    source, cache = tmp_path / "source", tmp_path / "cache"
    source.mkdir()
    (source / f"{module}.py").write_text(FORMULAS)
    monkeypatch.syspath_prepend(str(source))
    monkeypatch.setenv("FTQP_CACHE_DIR", str(cache))
    yield Tiny(source=source, module=module, cache=cache)
    sys.modules.pop(module, None)


@pytest.fixture
def log(caplog: pytest.LogCaptureFixture) -> pytest.LogCaptureFixture:
    """The warnings that were logged since."""
    caplog.set_level(logging.WARNING, logger="ftqp")
    return caplog
