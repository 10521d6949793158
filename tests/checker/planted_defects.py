"""Plants a defect into the source of the kernel, runs a planner with it, and lets the checker look.

    NUMBA_DISABLE_JIT=1 python tests/checker/planted_defects.py

Nothing is compiled, so that a changed function counts. Prints the laws that each run broke as one JSON
object, with those of the same run without the defect.
"""

import inspect
import json
import sys
from importlib import import_module

import numpy as np

import ftqp
from ftqp.checker.checked_run import verdict
from ftqp.checker.model_file import ModelFile
from ftqp.checker.trace import Failure, Trace
from ftqp.kernel.compiled.library import _KERNEL
from ftqp.qp.adapters.backend import Claim

NEVER = float("inf")


def plant(module, old, new):
    """Replace a line of a module of the kernel and put its functions wherever they were imported."""
    source = inspect.getsource(module)
    assert source.count(old) == 1, f"{module.__name__} has {source.count(old)} times: {old}"
    before = {name: thing for name, thing in vars(module).items() if inspect.isfunction(thing)}
    exec(compile(source.replace(old, new), module.__file__, "exec"), vars(module))
    changed = {id(thing): vars(module)[name] for name, thing in before.items()}
    for other in [m for name, m in list(sys.modules.items()) if name.startswith("ftqp.")]:
        for name, thing in list(vars(other).items()):
            if id(thing) in changed and inspect.isfunction(thing):
                setattr(other, name, changed[id(thing)])
    _KERNEL._ready.clear()  # entry points hold what they call


class Boxless(ftqp.Backend):
    """A solver that knows no bounds: the clamp behind it has to see to them."""

    package = "ftqp"

    def __init__(self):
        super().__init__("boxless")

    def _prepare(self, qp):
        pass

    def _run(self, qp, cold):
        n, m = qp.n, qp.m
        K = np.block([[qp.H, qp.A.T], [qp.A, np.zeros((m, m))]])
        answer = np.linalg.lstsq(K, np.concatenate([-qp.g, qp.b]), rcond=None)[0]
        qp.multipliers[:] = 0.0
        qp.x[:], qp.y[:] = answer[:n], answer[n:]
        return Claim.SOLVED


def run(robot, path, ticks, *, dt=0.005, planner=None, failures=(), obeys=None, can_be_followed=False):
    """The trace of a run: planner and an arm that does what it is told but for its failed joints."""
    planner = planner or ftqp.Planner(robot, dt)
    t = np.arange(ticks) * dt
    samples = path.sample(t)
    targets = ftqp.Targets(samples.pose, samples.twist, samples.acceleration)
    q = np.array(robot.neutral)
    v = np.zeros(robot.nv)
    planner.reset(q)
    truth, sent, said = [(q, v)], [], []
    for k in range(ticks):
        for failure in failures:
            if abs(failure.reported_at - t[k]) < 0.5 * dt:
                planner.report(ftqp.Locked(failure.joint))
        step = planner.step(q, v, targets.at(k))
        sent.append((step.q.copy(), step.v.copy()))
        said.append(step.status.name)
        before = q
        q, v = sent[-1][0].copy(), sent[-1][1].copy()
        if obeys is not None:
            q, v = obeys(t[k], before, q, v)
        truth.append((q, v))
    return Trace(
        dt=dt,
        level=planner.level,
        q=np.array(truth)[:, 0],
        v=np.array(truth)[:, 1],
        sent_q=np.array(sent)[:, 0],
        sent_v=np.array(sent)[:, 1],
        status=said,
        target=samples.pose,
        rows=robot.default_rows,
        tolerance=(planner.task.tolerance, planner.task.rotation_tolerance),
        failures=failures,
        can_be_followed=can_be_followed,
    )


def too_fast():
    """A circle that is faster than the joints can be, with a solver that leaves the bounds to the clamp."""
    robot = ftqp.robots.load("planar", count=4)
    planner = ftqp.Planner(robot, 0.005, backend=Boxless(), emergency=None)
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.4, duration=0.8)
    return robot, run(robot, path, 60, planner=planner)


def lost_joint():
    """A slow circle during which a joint locks, the planner is told, and the others can do without it."""
    robot = ftqp.robots.load("planar", count=4)
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.05, duration=2.0)
    lock = Failure(joint=1, kind="locked", since=0.1, reported_at=0.1)
    return robot, run(robot, path, 90, failures=[lock], can_be_followed=True)


def near_the_end():
    """A circle round the base, which turns the first joint fast into the end of its range."""
    robot = ftqp.robots.load("planar", count=2)
    tip = robot.pose(robot.neutral)
    way = tip[:3, 3] / np.linalg.norm(tip[:3, 3])
    across = np.array([-way[1], way[0], 0.0])
    duration = 2.0 * np.pi * 1.875 / (0.9 * robot.limits.v_max[0])
    path = ftqp.paths.Circle(tip, np.linalg.norm(tip[:3, 3]), duration=duration, axes=(way, across))
    planner = ftqp.Planner(robot, 0.01, emergency=None)
    return robot, run(robot, path, round(0.42 * duration / 0.01), dt=0.01, planner=planner)


def out_of_reach():
    """A line that leaves the workspace."""
    robot = ftqp.robots.load("planar", count=4)
    way = 2.0 * robot.length * 6.0 * np.array([1.0, 0.0, 0.0])
    path = ftqp.paths.Line(robot.pose(robot.neutral), way, duration=1.0)
    planner = ftqp.Planner(robot, 0.005, emergency=None)
    return robot, run(robot, path, 80, planner=planner)


DEFECTS = {
    "clamp off": (
        too_fast,
        "judge.solution_check",
        "x = min(max(qp.x[i], qp.lb[i]), qp.ub[i])",
        "x = qp.x[i]",
        ("feedback.gate", "    if not through:\n", "    if False:\n"),  # else the gate brakes in its place
    ),
    "a locked column kept": (
        lost_joint,
        "rows.failed_joints",
        "            fix(qp, i, 0.0)\n",
        "            qp.lb[i], qp.ub[i] = -limits.a_max[i], limits.a_max[i]\n",
    ),
    "viability off": (
        near_the_end,
        "rows.joint_intervals",
        "        return viability(v, d, v_max, limits.a_max[i], limits.a_brake[i], state.dt)\n",
        "        return one_step(v, d, v_max, limits.a_max[i], state.dt)\n",
        ("feedback.gate", "    if not through:\n", "    if False:\n"),  # as above
    ),
    "status forced to OK": (
        out_of_reach,
        "judge.fallback_cascade",
        "        if code != QP_READY and code != SOLVE:\n            return code\n",
        "        if code != QP_READY and code != SOLVE:\n            return 0\n",
    ),
}
"""Each defect: the run that shows it, the module of the kernel, the line, and what takes its place; and
what is changed with it, where the kernel would make up for it."""


def main():
    found = {}
    for name, (make, *change, beside) in ((name, (*one, None)[:5]) for name, one in DEFECTS.items()):
        changes = [change] if beside is None else [change, beside]
        for planted in (False, True):
            for module, old, new in changes if planted else ():
                plant(import_module(f"ftqp.kernel.{module}"), old, new)
            robot, trace = make()
            arm = ModelFile.read(robot.to_urdf(), robot.tip, gravity=robot.chain.gravity)
            seen = verdict(arm, trace)
            found.setdefault(name, {})["with" if planted else "without"] = sorted(seen.laws)
            statuses = {status: trace.status.count(status) for status in sorted(set(trace.status))}
            print(name, "planted" if planted else "not planted", statuses, file=sys.stderr)
            for breach in seen.breaches:
                print("   ", breach, file=sys.stderr)
        for module, old, _ in changes:
            plant(import_module(f"ftqp.kernel.{module}"), old, old)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
