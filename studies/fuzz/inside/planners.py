"""What an episode from inside is about: a planner of any drive, level, scheme and task, drawn at random."""

import logging
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

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
    "dual_panda",
    "driving",
    "floating",
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
    torques = robot.has_inertia and not robot.chain.floating
    drive = one((*DRIVES, "torque") if torques else DRIVES[:-1])
    scheme = one(SCHEMES if robot.has_inertia else SCHEMES[:3])
    dt, backend = one(TIMES), one(BACKENDS)
    latency = 0.0 if rng.random() < 0.8 else dt * int(rng.integers(1, 4))
    bounds = "viability" if rng.random() < 0.9 else one(("jin", "one_step"))
    watched = int(rng.integers(WATCHED_BY)) == 0
    degrades = backend == "active_set" and int(rng.integers(DEGRADES_BY)) == 0
    sets = ("position_axis", "position") if degrades and len(robot.default_rows) > 3 else None
    beside = rng.spawn(1)[0]  # which leaves what is drawn besides as it was
    soft, kept = _soft(robot, beside), _kept(robot, beside)
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
        tasks=soft,
        constraints=kept,
    )
    words = (name, level, mode, f"dt {dt:g}", f"drive {drive}", f"late {latency:g}", scheme, backend, bounds)
    more = f"gives up {sets}", f"detector {watched}", f"{len(soft)} tasks", f"{len(kept)} constraints"
    return Made(
        robot=robot,
        planner=planner,
        sentence=", ".join([*words, *more]),
        drive=drive.split()[-1],
        viable=bounds == "viability",
        watched=watched,
    )


def _soft(robot: Any, rng: Any) -> list[Any]:
    """Further tasks of one planner in three, near the arm or far from it, on any level."""
    if rng.random() > 1.0 / 3.0:
        return []
    size = 10.0 ** rng.uniform(-2.0, 2.0)
    first, frame, other = (robot.joints[k] for k in (0, *rng.choice(robot.nv, 2, replace=False).tolist()))
    settings = {"weight": 10.0 ** rng.uniform(-3.0, 3.0), "kp": 10.0 ** rng.uniform(-1.0, 1.0)}

    def fill(state: Any, J: Any, b: Any) -> None:
        J[0, 0], b[0] = 1.0, 1e3 - state.q[0]

    tasks = [
        ftqp.PositionTask(frame, target=size * rng.normal(size=3), name="point", **settings),
        ftqp.AxisTask(frame, towards=size * rng.normal(size=3), name="axis", **settings),
        ftqp.PostureTask(name="posture", **settings),
        ftqp.LeastSquares(1, fill, name="own", **settings),
        ftqp.RelativeTask(frame, other, name="relative", **settings),
        ftqp.AxisTask(frame, towards=other, name="look", **settings),
    ]
    if other != first:
        place = robot.pose(robot.neutral, other)
        place[:3, 3] += 0.1 * size * rng.normal(size=3)
        rows = ("pose", "position", "orientation", ("z", "rx"))[int(rng.integers(4))]
        tasks.append(ftqp.PoseTask(other, rows=rows, target=place, name="pose", **settings))
    if robot.has_inertia:
        tasks.append(ftqp.CentreOfMass("xy", target=size * rng.normal(size=3), name="mass", **settings))
    chosen, rows = [], 0
    for task in tasks:
        if rng.random() < 0.4:
            may = task.can_go_first and rows + 6 <= 12 and rng.random() < 0.4
            rows += 6 * may
            later = int(rng.integers(1 if task.can_go_first else 2, 4))
            chosen.append(replace(task, level=0 if may else later))
    return chosen[:8]


def _kept(robot: Any, rng: Any) -> list[Any]:
    """Points that one planner in four keeps, near planes that the arm may be beyond."""
    if rng.random() > 0.25:
        return []
    tip = robot.pose(robot.neutral)[:3, 3]
    own = rng.normal(size=(2, robot.nv)), 10.0 ** rng.uniform(-3.0, 1.0, 2), int(rng.integers(1500))
    ticks = []

    def fill(state: Any, C: Any, l: Any, u: Any) -> None:
        ticks.append(None)
        if len(ticks) == own[2]:
            raise ValueError("the cable's length is lost")
        C[:], l[:], u[:] = own[0], -own[1], own[1]

    rows = [ftqp.Rows(2, fill, name="rows of one's own")] if rng.random() < 0.3 else []
    return rows + [
        ftqp.Keep(
            robot.tip if rng.random() < 0.5 else robot.joints[int(rng.integers(robot.nv))],
            **_boundary(tip, rng),
            braking=10.0 ** rng.uniform(-1.0, 1.0),
            name=f"point {k}",
        )
        for k in range(1 + int(rng.integers(3)))
    ]


def _boundary(tip: Any, rng: Any) -> dict[str, Any]:
    """A plane, a box with few sides, or a cone."""
    drawn = rng.random()
    if drawn < 0.6:
        return {"above": tip + rng.normal(size=3) * 0.2, "normal": rng.normal(size=3)}
    if drawn < 0.8:
        return {"along": rng.normal(size=3), "axis": rng.normal(size=3), "within": rng.uniform(0.01, 3.1)}
    low, high = np.full(3, -np.inf), np.full(3, np.inf)
    at = int(rng.integers(3))
    low[at], high[at] = tip[at] - rng.uniform(-0.1, 0.3), tip[at] + rng.uniform(0.11, 0.3)
    return {"inside": (low, high)}
