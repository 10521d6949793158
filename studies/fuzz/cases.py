"""What a fuzzed episode is about: a robot, a planner of it, and what a judge knows of both."""

import logging
from dataclasses import dataclass
from functools import cache
from typing import Any, final

import numpy as np

import ftqp
from ftqp.checker.model_file import ModelFile
from ftqp.model.serial import Inertial
from ftqp.model.urdf_text import link_names

ROBOTS = (
    "panda",
    "panda",
    "iiwa14",
    "xarm7",
    "planar(4)",
    "srs7",
    "zhang7",
    "puma560",
    "turning",
    "modular11",
)
"""Arms with and without masses, with and without joints that turn without end, of one to eleven joints."""
MODES = ("slack", "slack", "hard", "scaled", "lexicographic")
DRIVES = ("position", "position", "position", "slow position", "velocity", "torque")
BACKENDS = ("active_set",) * 22 + ("dtrnn", "daqp")
SCHEMES = ("mvn", "mvn", "rmp", "mke", "dlsm")
TIMES = (0.001, 0.001, 0.002, 0.005, 0.01)
"""Sampling periods [s]."""
WATCHED_BY = 24
"""One planner in so many has a detector."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One planner, made as the numbers say.

    Attributes:
        robot: The arm.
        arm: The same as a checker reads it.
        planner: Its planner.
        sentence: What was drawn.
        dt: Sampling period [s].
        level: ``acceleration`` or ``velocity``.
        drive: What the arm takes.
        latency: How many ticks samples are late.
        rows: The rows of the task.
        viable: Whether the conversion of limits promises that every joint can still brake.
        watched: Whether a detector may believe what nobody reported.
        noise: Standard deviation of the positions that the planner was told of [rad or m].
    """

    robot: Any
    arm: ModelFile
    planner: Any
    sentence: str
    dt: float
    level: str
    drive: str
    latency: int
    rows: tuple[str, ...]
    viable: bool
    watched: bool
    noise: float


@cache
def robot_of(name: str) -> Any:
    """A robot of the catalog; ``turning`` is a planar arm whose joints turn without end.

    ``driving`` and ``floating`` are a Panda on a base that does.
    """
    if name == "turning":
        return ftqp.robots.load("planar", lengths=(1.0, 1.0, 0.5), continuous=True)
    if name in ("driving", "floating"):
        body = Inertial(mass=80.0, com=np.zeros(3), inertia=np.diag([8.0, 9.0, 10.0]))
        arm = ftqp.robots.load("panda")
        return (
            arm.on_free_base(body)
            if name == "floating"
            else arm.on_planar_base(v_max=1.0, a_max=3.0, inertial=body)
        )
    return ftqp.robots.load(name)


@cache
def arm_of(name: str) -> ModelFile:
    """The same arm as pinocchio reads it from its URDF."""
    return read_again(robot_of(name))


def read_again(robot: Any) -> ModelFile:
    """A robot as pinocchio reads it from its URDF."""
    return ModelFile.read(
        robot.to_urdf(), link_names(robot.joints, robot.tips)[robot.nv + 1], gravity=robot.chain.gravity
    )


def drawn(rng: np.random.Generator, arms: tuple[str, ...] = ROBOTS) -> Case:
    """A random case."""
    logging.getLogger("ftqp").setLevel(logging.ERROR)  # warnings of starts near a singularity

    def one(values: Any) -> Any:
        return values[int(rng.integers(len(values)))]

    name, level, mode = one(arms), one(("acceleration", "velocity")), one(MODES)
    robot = robot_of(name)
    drive = one(DRIVES if robot.has_inertia else DRIVES[:-1])
    scheme = one(SCHEMES if robot.has_inertia else SCHEMES[:3])
    dt, backend = one(TIMES), one(BACKENDS)
    latency = 0 if rng.random() < 0.7 else int(rng.integers(1, 4))
    sigma = 0.0 if rng.random() < 0.7 else 1e-4
    bounds = "viability" if rng.random() < 0.9 else one(("jin", "one_step"))
    stop = ftqp.EmergencyStop() if rng.random() < 0.6 else None
    rows = None if rng.random() < 0.6 or len(robot.default_rows) < 3 else one(("position", "position_axis"))
    watched = int(rng.integers(WATCHED_BY)) == 0
    task = ftqp.Task(mode=mode, rows=rows, calm=bool(rng.random() < 0.8))
    planner = ftqp.Planner(
        robot,
        dt,
        level=level,
        scheme=scheme,
        task=task,
        bounds=bounds,
        backend=backend,
        emergency=stop,
        timing=bool(rng.random() < 0.1),
        drive=drive_of(drive, latency * dt),
        noise=ftqp.Noise(q=sigma) if sigma or watched else None,
        detector=ftqp.Detector() if watched else None,
    )
    words = (name, level, mode, f"dt {dt:g}", f"drive {drive}", f"latency {latency}", scheme, backend, bounds)
    return Case(
        robot=robot,
        arm=arm_of(name),
        planner=planner,
        sentence=", ".join([*words, f"rows {rows}", f"noise {sigma:g}", f"detector {watched}"]),
        dt=dt,
        level=level,
        drive=drive.split()[-1],
        latency=latency,
        rows=planner.task_rows,
        viable=bounds == "viability",
        watched=watched,
        noise=sigma,
    )


def drive_of(name: str, latency: float) -> ftqp.Drive:
    """A drive by its name here."""
    if name == "slow position":
        return ftqp.Drive(kind="position", bandwidth=60.0, takes_velocity=False, latency=latency)
    return ftqp.Drive(kind=name, latency=latency)
