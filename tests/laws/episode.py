"""A random closed-loop episode, from robot to dt, as the checker judges it."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from tests.every_fault import draw_fault

import ftqp
from ftqp.checker.checked_run import verdict
from ftqp.checker.model_file import ModelFile
from ftqp.checker.trace import Failure, Trace

ROBOTS = ("panda", "iiwa14", "xarm7", "planar6", "srs7", "zhang7", "planar(10)")
BACKENDS = ("active_set",) * 6 + ("dtrnn", "daqp", "proxqp", "quadprog", "osqp")
SMALL = 8
"""Arms of more joints take active_set, and no joint swings freely, unless everything is asked for: that
takes long to compile."""


@dataclass(frozen=True, slots=True)
class Episode:
    """What was drawn, and what the checker finds wrong of it."""

    seed: int
    description: str
    breaches: list[Any]


def draw_path(generator: np.random.Generator, robot: Any, start: Any, duration: float) -> Any:
    """A random path of a size that the robot may or may not be able to follow."""
    size = robot.length * generator.uniform(0.1, 3.0)
    planar = len(robot.default_rows) < 3 or "z" not in robot.default_rows
    direction = generator.normal(size=3)
    if planar:
        direction[2] = 0.0
    kind = generator.choice(["line", "square", "circle", "lissajous"])
    if kind == "line":
        return ftqp.paths.Line(start, size * direction / np.linalg.norm(direction), duration=duration)
    if kind == "square":
        return ftqp.paths.Square(start, size, duration=duration)
    if kind == "circle":
        return ftqp.paths.Circle(start, 0.5 * size, duration=duration)
    return ftqp.paths.Lissajous(start, amplitudes=(0.5 * size, 0.4 * size), duration=duration)


def start_of(generator: np.random.Generator, robot: Any) -> Any:
    """A configuration inside the limits, near the robot's neutral one."""
    low, high = robot.limits.q_min, robot.limits.q_max
    spread = np.where(np.isfinite(high - low), high - low, 2.0)
    q = robot.neutral + generator.uniform(-0.2, 0.2, robot.nv) * spread
    margin = 0.02 * spread
    return np.clip(q, low + margin, high - margin)


def run(seed: int, everything: bool = False) -> Episode:
    """Draw and run one episode.

    Args:
        seed: Of the episode.
        everything: Whether arms of many joints are tried with all that there is.
    """
    generator = np.random.default_rng(seed)
    robot = ftqp.robots.load(str(generator.choice(ROBOTS)))
    level = str(generator.choice(["velocity", "acceleration"]))
    dt = float(generator.choice([0.001, 0.002, 0.005, 0.01]))
    mode = str(generator.choice(["slack", "slack", "slack", "hard", "scaled", "lexicographic"]))
    backend = str(generator.choice(BACKENDS))
    if robot.nv > SMALL and not everything:
        backend = "active_set"
    schemes = ["mvn", "rmp"] + (["mke", "dlsm"] if robot.has_inertia else [])
    scheme = str(generator.choice(schemes))
    q = start_of(generator, robot)
    duration = float(generator.uniform(0.5, 2.0))
    path = draw_path(generator, robot, robot.pose(q), duration)
    fault = draw_fault(generator, robot, swings=everything or robot.nv <= SMALL)
    at = int(generator.integers(round(duration / dt)))
    stop = None if generator.random() < 0.5 else ftqp.EmergencyStop()
    name = f"{robot.name} {level} dt={dt} {mode} {backend} {scheme} {type(path).__name__} {duration:.2f} s"
    name += f", {fault} at {at}"
    planner = ftqp.Planner(
        robot, dt, level=level, scheme=scheme, task=ftqp.Task(mode=mode), backend=backend, emergency=stop
    )
    t = np.arange(round(duration / dt) + round(0.2 / dt)) * dt
    samples = path.sample(t)
    target = ftqp.Target(pose=path.start)
    planner.reset(q)
    v = np.zeros(robot.nv)
    truth, said = [(q, v)], []
    for k in range(len(t)):
        if k == at:
            planner.report(fault)
        target.pose[:], target.twist[:] = samples.pose[k], samples.twist[k]
        target.acceleration[:] = samples.acceleration[k]
        step = planner.step(q, v, target)
        q, v = step.q.copy(), step.v.copy()
        truth.append((q, v))
        said.append(step.status.name)
    return Episode(
        seed=seed, description=name, breaches=breaches(planner, truth, said, samples.pose, fault, at)
    )


@cache
def judged_arm(robot: Any) -> ModelFile:
    """The arm as the checker knows it."""
    return ModelFile.read(robot.to_urdf(), robot.tip, gravity=robot.chain.gravity)


def breaches(planner: Any, truth: list[Any], said: list[str], targets: Any, fault: Any, at: int) -> list[Any]:
    """What the checker finds wrong of an arm that did what it was told, and lost a joint at a tick."""
    dt, places = planner.dt, np.array(truth)
    trace = Trace(
        dt=dt,
        level=planner.level,
        q=places[:, 0],
        v=places[:, 1],
        sent_q=places[1:, 0],
        sent_v=places[1:, 1],
        status=said,
        target=targets,
        rows=planner.robot.default_rows,
        tolerance=(planner.task.tolerance, planner.task.rotation_tolerance),
        failures=[failure_of(planner.robot, fault, at * dt, at * dt)],
    )
    return list(verdict(judged_arm(planner.robot), trace).breaches)


def failure_of(robot: Any, fault: Any, since: float, told: float) -> Failure:
    """What a checker is told of a fault."""
    kinds = {ftqp.Locked: "locked", ftqp.FreeSwinging: "free", ftqp.Degraded: "degraded"}
    return Failure(
        joint=robot.joint(fault.joint),
        kind=kinds[type(fault)],
        since=since,
        reported_at=told,
        shares={limit: getattr(fault, share) for limit, share in fault.shares.items()},
        jumps=getattr(fault, "mode", "") == "instant",
    )
