"""A random closed-loop episode, from robot to dt, and everything that must hold in it."""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.optimize import linprog
from tests.arm_at import arm_at
from tests.every_fault import draw_fault

import ftqp
from ftqp.checker.trace import Failure, Trace

ROBOTS = ("panda", "iiwa14", "xarm7", "planar6", "srs7", "zhang7", "planar(10)")
BACKENDS = ("active_set",) * 6 + ("dtrnn", "daqp", "proxqp", "quadprog", "osqp")
SMALL = 8
"""Arms of more joints take active_set, and no joint swings freely, unless everything is asked for: that
takes long to compile."""
SPEED_TOLERANCE = 1e-9
"""Share of a limit by which rounding may exceed it: one tolerance for every backend, robot and level."""


@dataclass
class Episode:
    """What was drawn, and what went wrong (nothing, if the laws hold)."""

    seed: int
    description: str
    backend: str
    ticks: int = 0
    broken: list[str] = field(default_factory=list)
    statuses: dict[str, int] = field(default_factory=dict)
    trace: Any = None
    robot: Any = None


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
    """Draw and run one episode; every law is checked on every tick.

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
    episode = Episode(seed=seed, description=name, backend=backend)
    planner = ftqp.Planner(
        robot, dt, level=level, scheme=scheme, task=ftqp.Task(mode=mode), backend=backend, emergency=stop
    )
    t = np.arange(round(duration / dt) + round(0.2 / dt)) * dt
    samples = path.sample(t)
    target = ftqp.Target(pose=path.start)
    planner.reset(q)
    v = np.zeros(robot.nv)
    truth, sent, said = [(q, v)], [], []
    for k in range(len(t)):
        if k == at:
            planner.report(fault)
        target.pose[:], target.twist[:] = samples.pose[k], samples.twist[k]
        target.acceleration[:] = samples.acceleration[k]
        before = v
        step = planner.step(q, v, target)
        check(episode, planner, step, q, before, dt, k)
        q, v = step.q.copy(), step.v.copy()
        name = step.status.name
        truth.append((q, v))
        sent.append((q, v))
        said.append(name)
        episode.statuses[name] = episode.statuses.get(name, 0) + 1
    episode.ticks, episode.robot = len(t), robot
    episode.trace = Trace(
        dt=dt,
        level=level,
        q=np.array(truth)[:, 0],
        v=np.array(truth)[:, 1],
        sent_q=np.array(sent)[:, 0],
        sent_v=np.array(sent)[:, 1],
        status=said,
        target=samples.pose,
        rows=robot.default_rows,
        tolerance=(planner.task.tolerance, planner.task.rotation_tolerance),
        failures=[failure_of(robot, fault, at * dt, at * dt)],
    )
    return episode


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


def check(episode: Episode, planner: Any, step: Any, q: Any, v: Any, dt: float, k: int) -> None:
    """What must hold of one command."""

    def broken(what: str, worst: float) -> None:
        if len(episode.broken) < 5:
            episode.broken.append(f"tick {k} {step.status.name}: {what} by {worst:.3g}")

    if not (np.isfinite(step.q).all() and np.isfinite(step.v).all() and np.isfinite(step.a).all()):
        broken("command not finite", np.nan)
        return
    limits = believed(planner)
    faults = {planner.robot.joint(name): fault for name, fault in planner.faults.items()}
    held, free = (
        np.array([isinstance(faults.get(i), kind) for i in range(planner.robot.nv)])
        for kind in (ftqp.Locked, ftqp.FreeSwinging)
    )
    healthy = np.array([i not in faults or faults[i].works for i in range(planner.robot.nv)])
    v_max, a_max = limits.v_max, limits.a_max
    over = (np.abs(step.a) / a_max - 1.0)[healthy]
    if over.size and over.max() > 1e-6:
        broken("acceleration limit (share)", over.max())
    slower = np.maximum(
        v_max, np.abs(v) - a_max * dt
    )  # a limit that has just shrunk is reached at full deceleration
    over = (np.abs(step.v) / slower - 1.0)[healthy]
    if over.size and over.max() > SPEED_TOLERANCE:
        broken("velocity limit (share)", over.max())
    locked = held & (v == 0.0)  # one that still moves is being braked
    if (step.v[locked] != 0.0).any() or (step.a[locked] != 0.0).any() or (step.q[locked] != q[locked]).any():
        broken("locked joint moves", float(np.abs(step.v[locked]).max()))
    viable = lacking_room(planner, limits, q, v, dt) <= 0.0
    lack = lacking_room(planner, limits, step.q, step.v, dt)
    over = lack[healthy & viable]
    if over.size and over.max() > 1e-9:
        broken("leaves its position limits, or can no longer brake before them,", over.max())
    too_late = (
        healthy & ~viable & (np.abs(v) > a_max * dt) & (v * (limits.q_max + limits.q_min - 2.0 * q) < 0.0)
    )
    if too_late.any() and planner.level == "acceleration":  # a limit has just shrunk: full braking, no less
        short = (a_max + np.sign(v) * step.a)[too_late]
        if short.max() > 1e-6:
            broken("a joint that is too late to brake does not brake fully,", short.max())
    if planner.robot.has_inertia:
        over = (np.abs(step.tau) - limits.tau_max)[healthy]
        if over.size and over.max() > 1e-6:
            if step.status is ftqp.StepStatus.OK:
                broken("torque limit, with status OK,", over.max())
            elif least_excess(planner, limits, faults, step, q, v) < 1e-7:
                broken("torque limit, although the box leaves a way to keep it,", over.max())
        if free.any() and step.status is not ftqp.StepStatus.FALLBACK:
            arm = arm_at(planner.robot, q, v)
            friction = np.array([faults[i].damping if free[i] else 0.0 for i in range(planner.robot.nv)])
            rest = arm.M @ step.a + arm.h + friction * step.v
            stands = free & (step.v == 0.0)  # an end stop within 5 mrad carries it, and only pushes
            rest[stands & (q <= limits.q_min + 5e-3) & (rest > 0.0)] = 0.0
            rest[stands & (q >= limits.q_max - 5e-3) & (rest < 0.0)] = 0.0
            rest = rest[free]
            if np.abs(rest).max() > 1e-6 * (1.0 + np.abs(arm.h).max()):
                broken("free-swinging joint gets a torque", np.abs(rest).max())


def believed(planner: Any) -> SimpleNamespace:
    """The limits that are left of those of the robot, as the planner believes."""
    limits = planner.robot.limits
    names = ("q_min", "q_max", "v_max", "a_max", "tau_max")
    left = SimpleNamespace(**{name: getattr(limits, name).copy() for name in names})
    for name, fault in planner.faults.items():
        for limit, share in fault.shares.items():
            getattr(left, limit)[planner.robot.joint(name)] *= getattr(fault, share)
    return left


def lacking_room(planner: Any, limits: Any, q: Any, v: Any, dt: float) -> Any:
    """What each joint's room lacks for its braking distance, (n,); <= 0 where it can still brake."""
    q_min, q_max, a_max = limits.q_min, limits.q_max, limits.a_max
    speed = np.abs(v)
    need = speed**2 / (2.0 * a_max)
    if planner.level == "velocity":  # the next command is already slower: sum over j of (v - j a_max dt) dt
        steps = np.floor(speed / (a_max * dt))
        need = dt * (steps * speed - 0.5 * a_max * dt * steps * (steps + 1.0))
    ahead = np.where(v > 0.0, q_max - q, q - q_min) - need
    return -np.minimum(ahead, np.minimum(q_max - q, q - q_min))


def least_excess(planner: Any, limits: Any, faults: Any, step: Any, q: Any, v: Any) -> float:
    """By how much any x of the box must exceed the torque limits at least, a linear program.

    In N m, times dt at the velocity level; a free-swinging joint's torque is that of its friction.
    """
    arm, n = arm_at(planner.robot, q, v), planner.robot.nv
    at_velocity = planner.level == "velocity"
    scale = planner.dt if at_velocity else 1.0
    shift = scale * arm.h - (arm.M @ v if at_velocity else 0.0)
    rows, most = [], []
    for i in range(n):
        fault, row, limit = faults.get(i), arm.M[i].copy(), scale * limits.tau_max[i]
        if isinstance(fault, ftqp.Locked):
            continue
        offset = shift[i]
        if isinstance(fault, ftqp.FreeSwinging):
            row[i] += fault.damping * planner.dt
            offset += 0.0 if at_velocity else fault.damping * v[i]
            limit = 0.0
        if np.isfinite(limit):
            rows += [[*row, -1.0], [*-row, -1.0]]
            most += [limit - offset, limit + offset]
    bounds = [*zip(step.lower, step.upper, strict=True), (0.0, None)]
    found = linprog([0.0] * n + [1.0], A_ub=rows, b_ub=most, bounds=bounds, method="highs")
    return float(found.fun) if found.status == 0 else np.inf
