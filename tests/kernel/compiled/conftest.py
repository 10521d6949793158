"""A kernel of a few lines, written to a folder of its own, and the library that is built of it."""

import json
import logging
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

import ftqp
from ftqp.kernel.compiled.library import EntryPoint, Kernel

FORMULAS = """
import numpy as np

from ftqp.kernel.jit import COMPILED, carray, jit, part_jit, pointer, take

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
    \"\"\"A wave.\"\"\"
    return np.sin(x) * np.sqrt(k + 1.0) + x / 3.0  # of growing size


@part_jit
def total(X) -> float:
    s = 0.0
    for k in range(len(X)):
        s += wave(X[k], k)
    return s


def summed(joints=64):
    row = np.dtype([("x", np.float64, (joints,)), ("sum", np.float64)])

    def summed(address, count):
        record = carray(pointer(address), 1, row)[0]
        record.sum = total(record.x[:count])
        return count + joints

    return summed


def taken(joints=64):
    def taken(source, first, into, count, dimensions):
        return take(source, first, into, count, dimensions)

    return taken


def waiting(joints=64):
    def waiting(flag_at, most):
        flag = carray(pointer(flag_at), 1, FLOAT)
        turns = 0
        while flag[0] == 0.0 and turns < most:
            turns += 1
            give_way()
        return 1 if flag[0] == 1.0 else 0

    return waiting


def fails(joints=64):
    def fails(number):
        if number == 1:
            raise ValueError
        return number

    return fails


def allocates(joints=64):
    def allocates(count):
        X = np.ones(count)
        X[0] = 2.0
        return int(X.sum())

    return allocates
"""

BUILD = """
import json, sys
from pathlib import Path
from ftqp.kernel.compiled import library
library.BUILDING = True
from ftqp.kernel.compiled.library import EntryPoint
from ftqp.kernel.building.store import Store, build
from ftqp.kernel.building.wheel_targets import TARGETS, CannotBuild
from ftqp.kernel.compiled.making.emit import Target, target
given = json.loads(sys.argv[1])
wanted = [EntryPoint(name=n, module=given["module"], factory=n, signature=s, nogil=g)
          for n, s, g in given["wanted"]]
away, source = TARGETS.get(given["target"]), Path(given["source"])
where = target() if away is None else Target(away.triple, next(iter(away.levels)))
store = Store(Path(given["store"]))
try:
    with store.alone():
        out = Path(given["out"])
        print(build(out, {where.cpu: wanted}, [where], source, store, jobs=1, checked=True, away=away))
except CannotBuild as error:
    sys.exit(str(error))
"""


@dataclass(frozen=True, slots=True)
class Tiny:
    """The little kernel.

    Attributes:
        source: the folder with its module.
        module: the module's name.
        built: the folder of its library.
    """

    source: Path
    module: str
    built: Path

    def entry(self, name: str, signature: str, *, nogil: bool = False) -> EntryPoint:
        """An entry point of it; its factory has the same name."""
        return EntryPoint(name=name, module=self.module, factory=name, signature=signature, nogil=nogil)

    @property
    def summed(self) -> EntryPoint:
        """The entry point that adds up."""
        return self.entry("summed", "ii")

    @property
    def text(self) -> Path:
        """The file of its formulas."""
        return self.source / f"{self.module}.py"

    def kernel(self) -> Kernel:
        """A kernel that has loaded nothing yet."""
        return Kernel(self.source, self.built)

    def building(self, *wanted: EntryPoint, target: str = "") -> "subprocess.Popen[str]":
        """A process that builds its library, and says how many units were compiled."""
        given = {
            "module": self.module,
            "source": str(self.source),
            "out": str(self.built),
            "store": str(self.source.parent / "store"),
            "target": target,
            "wanted": [(one.name, one.signature, one.nogil) for one in wanted],
        }
        path = os.pathsep.join([str(Path(ftqp.__file__).parents[1]), str(self.source)])
        return subprocess.Popen(
            [sys.executable, "-c", BUILD, json.dumps(given)],
            # bytecode is told from its source by second and size: an edit of a test may change neither
            env={**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # workers of tests ignore Ctrl-C
        )

    def build(self, *wanted: EntryPoint, target: str = "") -> int:
        """Build its library, or that for another system: how many units were compiled."""
        said, errors = (process := self.building(*wanted, target=target)).communicate()
        assert process.returncode == 0, errors
        return int(said)


def _tiny(folder: Path) -> Tiny:
    module = "tiny_kernel_" + "".join(letter for letter in folder.name if letter.isalnum())
    source = folder / "source"
    source.mkdir()
    (source / f"{module}.py").write_text(FORMULAS)
    return Tiny(source=source, module=module, built=folder / "built")


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Tiny]:
    """One of which nothing is built yet."""
    one = _tiny(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # as in the processes that build it
    monkeypatch.syspath_prepend(str(one.source))
    yield one
    sys.modules.pop(one.module, None)


@pytest.fixture(scope="session")
def ready(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tiny]:
    """One whose library is built; leave it as it is."""
    one = _tiny(tmp_path_factory.mktemp("ready"))
    one.build(
        one.summed,
        one.entry("taken", "oiiii"),
        one.entry("waiting", "ii", nogil=True),
        one.entry("fails", "i"),
    )
    sys.path.insert(0, str(one.source))
    yield one
    sys.path.remove(str(one.source))


@pytest.fixture
def log(caplog: pytest.LogCaptureFixture) -> pytest.LogCaptureFixture:
    """The warnings that were logged since."""
    caplog.set_level(logging.WARNING, logger="ftqp")
    return caplog
