"""How the kernel is compiled: no memory in a step, the same without numba, a cache that sees changes."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import ftqp
from ftqp.kernel.jit import COMPILED, source_key

PACKAGE = Path(ftqp.__file__).parent
compiled_only = pytest.mark.skipif(not COMPILED, reason="this run is without compilation")

ALLOCATIONS = """
import gc, json, numpy as np, ftqp
from numba.core.runtime import rtsys
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
    before = tuple(rtsys.get_allocation_stats())
    for k in range(1000):
        target.position[0] += 1e-5
        step = planner.step(q, v, target)
        q[:], v[:] = step.q, step.v
    after = tuple(rtsys.get_allocation_stats())
    gc.callbacks.remove(watch)
    result[level] = [before, after, len(runs), int(step.code)]
print(json.dumps(result))
"""

TICKS = """
import json, numpy as np, ftqp
from ftqp.kernel.jit import COMPILED
result = {"compiled": COMPILED}
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

DRIFT = """
import json, sys, numpy as np
from ftqp.kernel.entry import entries as entry
from ftqp.kernel.layout.record import record
W = record()
W["n"] = W["nq"] = 1
W["rotation"][0, 0] = W["tip_rotation"] = np.eye(3).ravel()
W["tip_translation"] = (1.0, 0.0, 0.0)
entry.kinematics(W.ctypes.data, np.array([0.5]), np.array([1.0]))
hits = sum(entry.kinematics.stats.cache_hits.values()) if hasattr(entry.kinematics, "stats") else -1
print(json.dumps([W["J"][0, :2, 0].tolist(), hits]))
"""


def run(code, source=PACKAGE.parent, before="", **environment):
    """What ``code`` prints as JSON in a fresh process that imports ftqp from ``source``."""
    script = f"import sys; sys.path.insert(0, {str(source)!r})\n{before}\n{code}"
    result = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=500,
    )
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout.splitlines()[-1])


@compiled_only
def test_a_step_allocates_nothing_and_wakes_no_garbage_collector():
    for before, after, collections, code in run(ALLOCATIONS, NUMBA_NRT_STATS="1").values():
        assert code < 3
        assert after == before
        assert collections == 0


@compiled_only
def test_plain_python_gives_the_same_command():
    compiled, plain = run(TICKS), run(TICKS, NUMBA_DISABLE_JIT="1")
    assert compiled.pop("compiled") and not plain.pop("compiled")
    for level, values in compiled.items():
        assert np.abs(np.subtract(values, plain[level])).max() < 1e-12 * max(1.0, np.abs(values).max())


def test_without_numba_the_kernel_is_plain_python():
    block = "import sys; sys.modules['numba'] = None"
    plain = run(TICKS, before=block)
    assert plain.pop("compiled") is False
    expected = run(TICKS, NUMBA_DISABLE_JIT="1")
    assert all(plain[level] == expected[level] for level in plain)


@compiled_only
def test_the_cache_sees_a_change_in_any_file_of_the_kernel(tmp_path):
    copy = tmp_path / "src" / "ftqp"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
    J = [-np.sin(0.5), np.cos(0.5)]
    first, hits = run(DRIFT, copy.parent, **cache)
    assert np.allclose(first, J, atol=1e-15) and hits == 0
    again, hits = run(DRIFT, copy.parent, **cache)
    assert again == first and hits == 1
    helper = copy / "kernel" / "vectors.py"
    text = helper.read_text()
    assert text.count("a0 * b1 - a1 * b0") == 1 and text.count("a1 * b2 - a2 * b1") == 1
    helper.write_text(text.replace("a1 * b2 - a2 * b1", "7.0 + a1 * b2 - a2 * b1"))
    changed, hits = run(DRIFT, copy.parent, **cache)
    assert np.allclose(changed, [J[0] + 7.0, J[1]], atol=1e-14) and hits == 0


def test_source_key_depends_on_names_and_contents(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "a.py").write_text("x = 1\n")
    keys = [source_key(tmp_path)]
    (tmp_path / "sub" / "b.py").write_text("y = 1\n")
    keys.append(source_key(tmp_path))
    (tmp_path / "sub" / "b.py").write_text("y = 2\n")
    keys.append(source_key(tmp_path))
    (tmp_path / "sub" / "b.py").rename(tmp_path / "sub" / "c.py")
    keys.append(source_key(tmp_path))
    (tmp_path / "notes.txt").write_text("not source")
    assert len(set(keys)) == 4
    assert source_key(tmp_path) == keys[-1]
