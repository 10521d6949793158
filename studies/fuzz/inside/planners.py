"""What an episode from inside is about: a planner of any drive, level, scheme and task, drawn at random."""

import logging
from dataclasses import dataclass
from typing import Any, final

import ftqp
from fuzz.cases import DRIVES, SCHEMES, TIMES, drive_of, robot_of

ROBOTS = (
    "panda",
    "panda",
    "panda",
    "iiwa14",
    "xarm7",
    "planar(4)",
    "srs7",
    "puma560",
    "turning",
    "modular11",
)
MODES = ("slack", "slack", "hard", "scaled", "lexicographic")
BACKENDS = ("active_set",) * 30 + ("dtrnn", "daqp")
WATCHED_BY, DEGRADES_BY = 12, 6
"""One planner in so many has a detector, or gives up rows of its task."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Made:
    """A planner, made as the numbers say.

    Attributes:
        robot: The arm.
        planner: Its planner.
        sentence: What was drawn.
        drive: What the arm takes.
        viable: Whether the conversion of limits promises that accelerations stay inside their limits.
        watched: Whether a detector may believe what nobody reported.
    """

    robot: Any
    planner: Any
    sentence: str
    drive: str
    viable: bool
    watched: bool


def drawn(rng: Any, arms: tuple[str, ...] = ROBOTS) -> Made:
    """A random planner."""
    logging.getLogger("ftqp").setLevel(logging.CRITICAL)  # what is said of each stop fills the terminal

    def one(values: Any) -> Any:
        return values[int(rng.integers(len(values)))]

    name, level, mode = one(arms), one(("acceleration", "velocity")), one(MODES)
    robot = robot_of(name)
    drive = one((*DRIVES, "torque") if robot.has_inertia else DRIVES[:-1])
    scheme = one(SCHEMES if robot.has_inertia else SCHEMES[:3])
    dt, backend = one(TIMES), one(BACKENDS)
    latency = 0.0 if rng.random() < 0.8 else dt * int(rng.integers(1, 4))
    bounds = "viability" if rng.random() < 0.9 else one(("jin", "one_step"))
    watched = int(rng.integers(WATCHED_BY)) == 0
    degrades = backend == "active_set" and int(rng.integers(DEGRADES_BY)) == 0
    sets = ("position_axis", "position") if degrades and len(robot.default_rows) > 3 else None
    planner = ftqp.Planner(
        robot,
        dt,
        level=level,
        scheme=scheme,
        task=ftqp.Task(mode=mode, degrade=sets, calm=bool(rng.random() < 0.8)),
        bounds=bounds,
        backend=backend,
        emergency=ftqp.EmergencyStop() if rng.random() < 0.3 else None,
        timing=bool(rng.random() < 0.05),
        drive=drive_of(drive, latency),
        noise=ftqp.Noise(q=1e-4) if watched else None,
        detector=ftqp.Detector() if watched else None,
    )
    words = (name, level, mode, f"dt {dt:g}", f"drive {drive}", f"late {latency:g}", scheme, backend, bounds)
    return Made(
        robot=robot,
        planner=planner,
        sentence=", ".join([*words, f"gives up {sets}", f"detector {watched}"]),
        drive=drive.split()[-1],
        viable=bounds == "viability",
        watched=watched,
    )
