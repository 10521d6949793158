"""Same input, same output: for every backend, in every process, whatever was computed before."""

import hashlib
import subprocess
import sys

import numpy as np
import pytest

import ftqp

DT = 2e-3
TICKS = 240
BACKENDS = ("active_set", "dtrnn", "daqp", "proxqp", "osqp", "quadprog")
RUNS = tuple((backend, level) for backend in BACKENDS for level in ("acceleration", "velocity"))


def commands(backend, level, litter):
    """A digest of all commands on a circle with a lock in its middle; ``litter`` [bytes] moves the heap."""
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, level=level, backend=backend, emergency=None)
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.05, duration=1.0, axes=("y", "z"))
    sample = path.sample(np.arange(TICKS) * DT)
    rng, kept, digest = np.random.default_rng(0), [], hashlib.sha256()
    q, v = robot.neutral.copy(), np.zeros(7)
    planner.reset(q)
    for k in range(TICKS):
        if litter:
            kept.append(bytearray(int(rng.integers(1, litter))))
        if k == TICKS // 2:
            planner.report(ftqp.Locked(2))
        target = ftqp.Target(pose=sample.pose[k], twist=sample.twist[k], acceleration=sample.acceleration[k])
        step = planner.step(q, v, target)
        q, v = step.q.copy(), step.v.copy()
        digest.update(q.tobytes() + v.tobytes() + step.a.tobytes())
    return digest.hexdigest()


def digests(order, litters):
    """Every run in a process of its own, in that order, each with each litter; by run."""
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import test_repeatability as law\n"
        f"for run in law.RUNS[::{order}]:\n"
        f"    for litter in {litters}: print(*run, law.commands(*run, litter))"
    )
    folder = __file__.rpartition("/")[0]
    done = subprocess.run([sys.executable, "-c", code, folder], capture_output=True, text=True, check=True)
    found: dict[tuple[str, str], set[str]] = {run: set() for run in RUNS}
    for line in done.stdout.splitlines():
        backend, level, digest = line.split()
        found[backend, level].add(digest)
    return found


@pytest.fixture(scope="module")
def both():
    return digests(1, (0, 3000)), digests(-1, (77,))


@pytest.mark.long
@pytest.mark.solvers
@pytest.mark.parametrize("run", RUNS, ids=" ".join)
def test_two_processes_and_two_orders_command_bitwise_the_same(both, run):
    first, second = both
    assert len(first[run] | second[run]) == 1
