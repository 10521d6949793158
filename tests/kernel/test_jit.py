"""How the kernel runs: no memory in a step, the same as plain Python, and never numba."""

import json
import os
import re
import subprocess
import sys
import weakref
from pathlib import Path

import numpy as np
import pytest

import ftqp
from ftqp.kernel.compiled.library import level
from ftqp.kernel.entry.session import bound
from ftqp.kernel.jit import COMPILED, exact_jit, jit

SOURCE = Path(ftqp.__file__).parent.parent
ROOT = Path(__file__).resolve().parents[2]
built_only = pytest.mark.skipif(not level(), reason="no built kernel is in use")
LOOP = """
import gc, json, sys, numpy as np, ftqp
result = {}
for level in ("acceleration", "velocity"):
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, level=level, scheme="dlsm")
    q, v = robot.neutral.copy(), np.zeros(7)
    planner.reset(q)
    target = ftqp.Target(pose=robot.pose(q))
    planner.step(q, v, target)
    planner.report(ftqp.Locked(2))
    planner.step(q, v, target)
    runs = []
    watch = lambda phase, info: runs.append(phase)
    gc.collect()
    gc.callbacks.append(watch)
    before = sys.getallocatedblocks()
    for k in range(1000):
        target.position[0] += 1e-5
        step = planner.step(q, v, target)
        q[:], v[:] = step.q, step.v
    after = sys.getallocatedblocks()
    gc.callbacks.remove(watch)
    result[level] = [after - before, len(runs), int(step.code)]
print(json.dumps(result))
"""
TICKS = """
import json, numpy as np, ftqp
from ftqp.kernel.compiled.library import level
result = {"built": bool(level())}
for level in ("acceleration", "velocity"):
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, level=level, scheme="dlsm", torque_limits=False)
    q, v = robot.neutral.copy(), np.linspace(-0.1, 0.1, 7)
    planner.reset(q, v)
    target = ftqp.Target(pose=robot.pose(q))
    for k in range(4):
        if k == 2:
            planner.report(ftqp.Locked(1))
        target.position[2] += 1e-4
        step = planner.step(q, v, target)
        q, v = step.q.copy(), step.v.copy()
    result[level] = [*step.q.tolist(), *step.v.tolist(), *step.a.tolist(), int(step.code)]
print(json.dumps(result))
"""


def run(code, before="", **environment):
    """What ``code`` prints as JSON in a fresh process."""
    script = f"import sys; sys.path.insert(0, {str(SOURCE)!r})\n{before}\n{code}"
    result = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=500,
    )
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout.splitlines()[-1])


def test_what_an_entry_point_is_bound_to_lives_as_long_as_the_call():
    given = np.zeros(29)
    array, call = weakref.ref(given), bound("write_target", given)
    del given
    assert array() is not None
    del call
    assert array() is None


@built_only
def test_a_step_keeps_no_memory_and_wakes_no_garbage_collector():
    """That compiled code allocates nothing of its own is checked when it is made."""
    for blocks, collections, code in run(LOOP).values():
        assert code < 3
        assert blocks < 20  # a few numbers of the loop itself, not of its thousand steps
        assert collections == 0


@built_only
def test_plain_python_gives_the_same_command():
    built, plain = run(TICKS), run(TICKS, NUMBA_DISABLE_JIT="1")
    assert built.pop("built") and not plain.pop("built")
    for name, values in built.items():
        assert np.abs(np.subtract(values, plain[name])).max() < 1e-12 * max(1.0, np.abs(values).max())


@built_only
def test_built_kernel_runs_without_numba():
    block = "import sys; sys.modules['numba'] = sys.modules['llvmlite'] = None"
    assert run(TICKS, before=block) == run(TICKS)


@exact_jit
def rounded(x):
    """x to the whole number nearest to it, by its rounding beside a large one."""
    return (x + 6755399441055744.0) - 6755399441055744.0


@jit
def rounded_by_a_fast_caller(x):
    """The same in a function that may reorder sums."""
    return 3.0 * rounded(x)


@pytest.mark.skipif(not COMPILED, reason="runs where helpers are compiled: test_jit")
def test_rounding_stays_as_written_whoever_calls():
    numba = pytest.importorskip("numba")
    called = numba.njit(lambda x: rounded_by_a_fast_caller(x), error_model="numpy")
    assert called(2.3) == 6.0, "reordered, the large numbers would cancel and 6.9 be left"


FILES = ("rows/test_joint_intervals.py", "test_jit.py::test_rounding_stays_as_written_whoever_calls")


@pytest.mark.slow
def test_helpers_pass_their_tests_as_compiled_code():
    pytest.importorskip("numba")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not slow",
         *(str(ROOT / "tests" / "kernel" / file) for file in FILES)],
        cwd=ROOT,
        env={**os.environ, "FTQP_BUILD_KERNEL": "1", "PYTHONPATH": str(ROOT / "src")},
        capture_output=True,
        text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, (done.stdout + done.stderr)[-4000:]
    counted = re.search(r"(\d+) passed", done.stdout)
    assert counted is not None and int(counted[1]) >= 26 and "skipped" not in done.stdout, done.stdout[-500:]
