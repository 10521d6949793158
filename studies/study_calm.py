"""Whether arms come to rest where their target stands: random draws from a grid of everything that matters.

Robots of the catalog; targets in reach, 2 cm, 4 cm and 30 cm out of reach, on the base axis and at wrist
alignments; starts regular and exactly singular; no fault or one locked joint, from the start or at 1 s; both
levels, all task modes, rows of the robot or position only. The target moves for 2 s and then stands; nothing
but defaults, 2 ms, the emergency stop off.

A joint moves when it is faster than 1 % of its velocity limit. From 2 s of rest on a run

    rests               no healthy joint moves,
    travels             the error fell by more than 2 % in the half second before, and the arm rests by 4 s,
    far                 the same, but from 2 s of rest on some joint has a way of more than 2 s at full speed,
                        so that no planner could lead the arm there by 4 s: the error falls until it rests,
    slow                the same, but the way is shorter,
    moves               anything else.

The last two are exceptions, and so is a joint at 95 % of its acceleration limit for more than 0.2 s in all
from 2 s of rest on while the error does not fall, and an arm that holds an error below 1 mm.

    python studies/study_calm.py [--runs 2000] [--seed 1] [--only K] [--off] [--quick] [--out DIR] [--json]

2,000 runs take about four minutes on one core. Tables go to the screen; report and numbers to ``--out``.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from bench import study
from bench.tables import Table
from scipy.optimize import minimize

import ftqp

ROBOTS = ("iiwa14", "modular11", "panda", "planar(4)", "planar6", "puma560", "srs7", "xarm7", "zhang7")
TARGETS = ("in reach", "out 2 cm", "out 4 cm", "out 30 cm", "base axis", "wrist alignment")
GAPS = {"out 2 cm": 0.02, "out 4 cm": 0.04, "out 30 cm": 0.30}
STARTS = ("regular", "singular")
LEVELS = ("velocity", "acceleration")
MODES = ("slack", "hard", "scaled", "lexicographic")
DT = 0.002
MOVES = 2.0
"""How long the target moves [s]."""
RESTS = 16.0
"""How long it then stands [s]."""
FAULT_AT = 1.0
REST = 0.01
"""Share of the velocity limit below which a joint counts as at rest."""
AT_LIMIT = 0.95
LONGEST_AT_LIMIT = 0.2
FALLING = 0.02
"""An error that falls by this share in half a second does fall: the arm travels."""
GRACE = 0.5
"""How long a travelling arm may move without that, in all: it brakes, or goes round something [s]."""
KINDS = ("rests", "travels", "far", "slow", "moves")
LIMITATIONS = (
    "An ideal arm: no servo, no noise, no disturbance; torque limits are rows where the robot has them.",
    "The draw is uniform over each list on its own, so that rare combinations have few runs.",
    "Directions of targets out of reach are those in which the support point was found by a local search.",
)


@dataclass(frozen=True, slots=True)
class Case:
    """One run."""

    number: int
    robot: str
    target: str
    start: str
    level: str
    mode: str
    rows: str
    fault: int
    at: float


def case(number: int, seed: int) -> tuple[Case, np.random.Generator]:
    """The case of a number, and the generator that its details are drawn from."""
    rng = np.random.default_rng([seed, number])
    name = str(rng.choice(ROBOTS))
    joints = arm(name).nv
    planar = name.startswith("planar")
    targets = [t for t in TARGETS if not (planar and t == "wrist alignment")]
    fault = int(rng.integers(-1, joints)) if rng.random() < 0.7 else -1
    drawn = Case(
        number=number,
        robot=name,
        target=str(rng.choice(targets)),
        start=str(rng.choice(STARTS)),
        level=str(rng.choice(LEVELS)),
        mode=str(rng.choice(MODES)),
        rows="robot" if planar else str(rng.choice(["robot", "position"])),
        fault=fault,
        at=float(rng.choice([0.0, FAULT_AT])),
    )
    return drawn, rng


_ARMS: dict[str, ftqp.Robot] = {}
_SUPPORT: dict[tuple[str, int], tuple[Any, Any]] = {}


def arm(name: str) -> ftqp.Robot:
    """A robot, loaded once."""
    if name not in _ARMS:
        _ARMS[name] = ftqp.robots.load(name)
    return _ARMS[name]


def _ranges(robot: ftqp.Robot) -> tuple[Any, Any]:
    return np.maximum(robot.limits.q_min, -np.pi), np.minimum(robot.limits.q_max, np.pi)


def _support(name: str, number: int) -> tuple[Any, Any]:
    """One of eight directions, and the farthest point that the tip reaches along it."""
    key = (name, number)
    if key not in _SUPPORT:
        robot, rng = arm(name), np.random.default_rng(number)
        low, high = _ranges(robot)
        d = np.array([0.0, 0.0, 1.0]) if number == 0 else rng.normal(size=3)
        if name.startswith("planar"):
            d = np.array([1.0, 0.0, 0.0]) if number == 0 else np.array([d[0], d[1], 0.0])
        elif d[2] < 0.0:
            d[2] = -d[2]
        d /= np.linalg.norm(d)
        best, point = -np.inf, None
        for _ in range(6):
            start = rng.uniform(low, high)
            found = minimize(
                lambda q: -float(d @ robot.pose(q)[:3, 3]), start, bounds=list(zip(low, high, strict=True))
            )
            if -found.fun > best:
                best, point = -found.fun, robot.pose(found.x)[:3, 3]
        _SUPPORT[key] = d, point
    return _SUPPORT[key]


def _start(drawn: Case, rng: np.random.Generator) -> Any:
    robot = arm(drawn.robot)
    low, high = robot.limits.q_min, robot.limits.q_max
    if drawn.start == "singular":
        return np.clip(np.zeros(robot.nv), low, high)
    return np.clip(robot.neutral + rng.uniform(-0.3, 0.3, robot.nv), low + 0.02, high - 0.02)


def _goal(drawn: Case, start: Any, rng: np.random.Generator) -> Any:
    """The pose where the target comes to rest."""
    robot = arm(drawn.robot)
    pose = robot.pose(start).copy()
    low, high = _ranges(robot)
    if drawn.target in GAPS:
        d, point = _support(drawn.robot, int(rng.integers(8)))
        pose[:3, 3] = point + GAPS[drawn.target] * d
    elif drawn.target == "base axis":
        height = float(rng.uniform(0.1, 5.0)) * robot.length
        pose[:3, 3] = 0.0 if drawn.robot.startswith("planar") else (0.0, 0.0, height)
    elif drawn.target == "in reach":
        pose = robot.pose(np.clip(start + rng.uniform(-0.7, 0.7, robot.nv), low + 0.05, high - 0.05))
    else:
        q = np.clip(start + rng.uniform(-0.7, 0.7, robot.nv), low, high)
        q[-2] = np.clip(0.0, low[-2], high[-2])  # the axes beside the last but one fall into one line
        pose = robot.pose(q)
    return pose


def targets_of(drawn: Case, rng: np.random.Generator) -> tuple[Any, Any]:
    """Start and targets: a quintic straight way for MOVES, then rest."""
    start = _start(drawn, rng)
    goal = _goal(drawn, start, rng)
    path = ftqp.paths.PointToPoint(arm(drawn.robot).pose(start), goal, duration=MOVES)
    sample = path.sample(DT * np.arange(round((MOVES + RESTS) / DT)))
    return start, ftqp.Targets(sample.pose, sample.twist, sample.acceleration)


def planner_of(drawn: Case, calm: bool) -> ftqp.Planner:
    """The planner of a case."""
    rows = None if drawn.rows == "robot" else drawn.rows
    task = ftqp.Task(mode=drawn.mode, rows=rows, calm=calm)
    return ftqp.Planner(arm(drawn.robot), DT, level=drawn.level, task=task, emergency=None)


@dataclass(frozen=True, slots=True)
class Seen:
    """What a run shows.

    Attributes:
        speed: Of the fastest healthy joint, over its limit, (T,).
        effort: The same of accelerations, (T,).
        errors: Of the tip, rotations times the length, (T,) [m].
        way: The longest way of a healthy joint from 2 s of rest to the end, at full speed [s].
        holding: Whether the arm holds in the end.
    """

    speed: Any
    effort: Any
    errors: Any
    way: float
    holding: bool


def run(drawn: Case, rng: np.random.Generator, calm: bool = True) -> Seen:
    """One run, seen from outside."""
    start, targets = targets_of(drawn, rng)
    planner = planner_of(drawn, calm)
    robot = planner.robot
    planner.reset(start)
    q, v, rows = start.copy(), np.zeros(robot.nv), []
    for k in range(len(targets)):
        if drawn.fault >= 0 and k == round(drawn.at / DT):
            planner.report(ftqp.Locked(drawn.fault))
        step = planner.step(q, v, targets.at(k))
        rows.append((q, v, step.a.copy(), step.position_error, step.rotation_error))
        q, v = step.q.copy(), step.v.copy()
    places, speeds, accelerations, position, rotation = map(np.array, zip(*rows, strict=True))
    healthy = [i for i in range(robot.nv) if i != drawn.fault]
    speed = np.abs(speeds)[:, healthy] / robot.limits.v_max[healthy]
    effort = np.abs(accelerations)[:, healthy] / robot.limits.a_max[healthy]
    errors = np.hypot(position, robot.length * rotation)
    way = np.abs(places[-1] - places[round((MOVES + 2.0) / DT)])[healthy]
    return Seen(
        speed=speed.max(axis=1),
        effort=effort.max(axis=1),
        errors=errors,
        way=float((way / robot.limits.v_max[healthy]).max()),
        holding=bool(planner.session().K.settling.holding),
    )


def judged(drawn: Case, rng: np.random.Generator, calm: bool = True) -> dict[str, Any]:
    """What one run shows, and what of the laws it breaks."""
    seen = run(drawn, rng, calm)
    speed, errors = seen.speed, seen.errors
    two, half = round((MOVES + 2.0) / DT), round(0.5 / DT)
    moving = speed > REST
    falling = np.zeros(len(errors), dtype=np.bool_)
    falling[half:] = errors[half:] < (1.0 - FALLING) * errors[:-half]
    last = DT * (int(np.flatnonzero(moving)[-1]) if moving.any() else 0) - MOVES
    idle = DT * float(np.count_nonzero((moving & ~falling)[two:]))
    pressed = seen.effort >= AT_LIMIT
    at_limit = DT * float(np.count_nonzero((pressed & ~falling)[two:]))
    kind = "rests"
    if moving[two:].any():
        kind = "moves"
        if falling[two] and idle <= GRACE and last < RESTS - 0.5:
            kind = "travels" if last <= 4.0 else ("far" if seen.way > 2.0 else "slow")
    broken = [kind] if kind in ("slow", "moves") else []
    if at_limit > LONGEST_AT_LIMIT:
        broken.append("at its limits")
    if seen.holding and errors[-1] < 1e-3:
        broken.append("holds short")
    return asdict(drawn) | {
        "kind": kind,
        "broken": broken,
        "speed": float(speed[two:].max()),
        "last": last,
        "idle": idle,
        "at_limit": at_limit,
        "at_limit_in_all": DT * float(np.count_nonzero(pressed[two:])),
        "error": float(errors[-1]),
        "holding": seen.holding,
    }


def _table(rows: Sequence[dict[str, Any]], by: str) -> Table:
    """How runs end, by the values of a key."""
    lines = []
    for value in [*sorted({str(row[by]) for row in rows}), "all"]:
        own = [row for row in rows if value == "all" or str(row[by]) == value]
        kinds = [sum(row["kind"] == kind for row in own) for kind in KINDS]
        laws = [sum(law in row["broken"] for row in own) for law in ("at its limits", "holds short")]
        lines.append((value, *map(str, (len(own), *kinds, *laws, sum(row["holding"] for row in own)))))
    heads = (by, "runs", "rest", "travel", "far", "slow", "move", "at limits", "hold short", "held")
    return Table(title=f"By {by}", headings=heads, rows=lines)


def tables(found: dict[str, Any]) -> list[Table]:
    """The tables for a reader, and every exception."""
    rows, lines = found["rows"], []
    for row in (row for row in rows if row["broken"]):
        fault = "healthy" if row["fault"] < 0 else f"joint {row['fault']} locked at {row['at']:g} s"
        about = [str(row[key]) for key in ("robot", "target", "start", "level", "mode", "rows")]
        lines.append((
            str(row["number"]), ", ".join([*about, fault]), ", ".join(row["broken"]), f"{row['speed']:.3f}",
            f"{row['last']:.2f}", f"{row['at_limit']:.2f}", f"{row['error']:.4f}", str(row["holding"]),
        ))  # fmt: skip
    heads = (
        "number", "case", "breaks", "speed", "last motion [s]", "at limits [s]", "error [m]", "held",
    )  # fmt: skip
    every = Table(title=f"{len(lines)} exceptions in {len(rows)} runs", headings=heads, rows=lines)
    return [*(_table(rows, by) for by in ("robot", "target", "start", "level", "mode")), every]


def measured(given: Any) -> dict[str, Any]:
    """A row a run."""
    runs = 60 if given.quick else given.runs
    return {"rows": [judged(*case(number, given.seed), not given.off) for number in range(runs)]}


if __name__ == "__main__":
    parser = study.options(__doc__, "study_calm", "60 runs")
    parser.add_argument("--runs", type=int, default=2000, help="how many are drawn")
    parser.add_argument("--seed", type=int, default=1, help="which draw")
    parser.add_argument("--only", type=int, help="one run by its number")
    parser.add_argument("--off", action="store_true", help="without calm; goes on record as a quick run")
    given = parser.parse_args()
    if given.only is None:
        quick = given.quick or given.off
        study.on_record(given, "Whether arms come to rest", measured, tables, LIMITATIONS, quick=quick)
    else:
        print(json.dumps(judged(*case(given.only, given.seed), not given.off), indent=2))
