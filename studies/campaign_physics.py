"""Random episodes in physics: whatever fails, however badly it is measured, the arm ends safe.

    python studies/campaign_physics.py --first 200000 --episodes 2000   the table of docs/evidence/physics.md
    python studies/campaign_physics.py --replay 200058

An episode is an arm in MuJoCo (panda, iiwa14 or xarm7; drive, load, friction, noise, latency, fault and its
time, reported at once, late or never) that follows a circle and then stands for two seconds. It is drawn from
its number alone. The tables say how often each law was broken, by arm, drive and fault, and how each
exception came about; the report goes to ``--out``. ``--replay K`` runs one of them and writes its figures.

What no planner can help is not counted: healthy joints' speed within 0.1 s after a brake has closed, or after
a joint without a motor that holds it has met its end stop.
"""

import logging
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from bench import study
from bench.tables import Table
from bench.wrapped_plant import WrappedPlant
from joblib import Parallel, delayed

import ftqp
from ftqp.control.drive.joint_drive import Drive, Noise
from ftqp.faults.kinds import Degraded, FreeSwinging, Locked
from ftqp.sim.log.metrics import STATUSES
from ftqp.sim.loop import Simulation
from ftqp.sim.plants.plant import Arm, Command, Plant

DT = 1e-3
REST = 2.0
"""How long the target stands at the end [s] ..."""
SWINGS = 6.0
"""... and after a joint began to swing freely, at least: without friction the arm has 5 s to come to rest."""
ARMS = ("panda", "iiwa14", "xarm7")
DRIVES = ("position", "velocity", "torque")
FAULTS = ("none", "locked", "locked at once", "free", "degraded", "slipping brake")
REPORTED = ("at once", "late", "never")
BANDWIDTH = 94.0
"""Of the joint servos [rad/s]."""
MIDDLE = 0.8
"""Share of every joint's range in which starts lie."""
REGULAR, LOAD = 0.15, 0.6
"""Least singular value of a start, lengths over the arm's, and most of a torque limit that weight takes."""
WRISTS = 3
"""The last joints, whose friction is a third: their inertia is small."""
STILL = 0.01
"""Share of the speed limit below which a joint is at rest ..."""
OVER = 20
"""... as a mean over so many ticks: what noise shakes a torque arm by goes nowhere."""
SPEED_SLACK, TORQUE_SLACK = 1.02, 1.0 + 1e-6
"""Largest speed and torque by their limits."""
IMPACT = 0.1
"""How long after an impact, of a brake or on an end stop, speeds are not counted [s]."""
JOLT = 0.02
"""How long after a motor has lost its torque unannounced nobody can know of it [s]."""
CLAIM = 0.1
"""How long OK may be said beyond the tolerance [s]."""
Array = np.ndarray[Any, Any]
LAWS = ("divergence", "speed", "torque", "end", "false OK")
ENDS = ("OK", "RELAXED", "STOPPED")
WHOLE = 2000
"""A campaign of fewer episodes is a quick one."""
LIMITATIONS = (
    "Loads, friction and faults are drawn evenly from ranges of our own, not from records of real arms.",
    "Sensors are late and noisy, but none breaks; one joint fails, of one arm, in one episode.",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Episode:
    """What is drawn; SI units."""

    seed: int
    arm: str
    drive: str
    radius: float
    duration: float
    noise: float
    latency: int
    payload: float
    friction: float
    fault: str
    joint: int
    at: float
    reported: str
    damping: float
    start: tuple[float, ...]
    plane: tuple[str, str]


def start(robot: ftqp.Robot, generator: np.random.Generator) -> Array:
    """A posture in the middle of the ranges, far from singularities and from what gravity forbids."""
    low, high = (np.clip(limit, -3.0, 3.0) for limit in (robot.limits.q_min, robot.limits.q_max))
    middle, half = 0.5 * (low + high), 0.5 * MIDDLE * (high - low)
    data, still = robot.model.createData(), np.zeros(robot.nv)
    while True:
        q: Array = middle + half * generator.uniform(-1.0, 1.0, robot.nv)
        J = robot.jacobian(q).copy()
        J[:3] /= robot.length
        weight = np.abs(pin.rnea(robot.model, data, q, still, still))
        if np.linalg.svd(J, compute_uv=False)[-1] > REGULAR and (weight < LOAD * robot.limits.tau_max).all():
            return q


def draw(seed: int) -> Episode:
    """The episode of that number."""
    rng = np.random.default_rng(seed)
    arm = str(rng.choice(ARMS))
    robot = ftqp.robots.load(arm)
    duration = float(rng.uniform(3.0, 6.0))
    light = arm == "xarm7"  # without rotor inertia in the catalog its wrists stick and slip
    return Episode(
        seed=seed,
        arm=arm,
        drive=str(rng.choice(DRIVES)),
        radius=float(rng.uniform(0.04, 0.1)),
        duration=duration,
        noise=float(rng.choice([0.0, 1e-5, 1e-4])),
        latency=int(rng.integers(0, 6)),
        payload=float(rng.choice([0.0, 0.5, 1.0])),
        friction=float(rng.choice([0.0, 0.2, 0.2 if light else 0.5])),
        fault=str(rng.choice(FAULTS)),
        joint=int(rng.integers(robot.nv)),
        at=float(rng.uniform(0.2, 0.8)) * duration,
        reported=str(rng.choice(REPORTED)),
        damping=float(rng.choice([0.0, 0.5, 3.0])),
        start=tuple(start(robot, rng).tolist()),
        plane=(("x", "y"), ("y", "z"), ("x", "z"))[int(rng.integers(3))],
    )


class Watched(WrappedPlant):
    """A plant that keeps, tick by tick, what the laws speak of.

    Attributes:
        states: true q, v at the tick and the torque that was asked for, (K, 3, nv).
        codes: status of each step, (K,).
        braked: when each joint was first asked to brake, infinite without that, (nv,) [ticks].
        asked: largest speed of the reference, by joint and tick, (K, nv) [rad/s].
    """

    def __init__(self, plant: Plant, ticks: int, nv: int) -> None:
        super().__init__(plant)
        self._kept, self._codes = np.zeros((ticks, 3, nv)), np.zeros(ticks, dtype=np.int64)
        self.asked, self.braked = np.zeros((ticks, nv)), np.full(nv, np.inf)
        self.ticks = 0

    def reset(self, q: Any, v: Any) -> None:
        """Begin at (q, v)."""
        super().reset(q, v)
        self.ticks = 0

    def advance(self, command: Command) -> None:
        """Keep the tick, then move on."""
        kept = self._kept[self.ticks]
        kept[0], kept[1] = self._plant.q, self._plant.v
        if self._plant.drive == "torque":
            kept[2] = command.tau
        self._codes[self.ticks] = command.code  # type: ignore[attr-defined]
        self.asked[self.ticks] = command.reference.v  # type: ignore[attr-defined]
        self.braked[command.brakes & np.isinf(self.braked)] = self.ticks
        self.ticks += 1
        self._plant.advance(command)

    @property
    def states(self) -> Array:
        return self._kept[: self.ticks]

    @property
    def codes(self) -> Array:
        return self._codes[: self.ticks]


@dataclass(frozen=True, slots=True)
class World:
    """All that takes part in an episode."""

    simulation: Simulation
    plant: Watched
    path: Any
    robot: Any
    tolerance: tuple[float, float]


def length(episode: Episode) -> float:
    """How long the episode lasts [s]."""
    swings = episode.at + SWINGS if episode.fault == "free" else 0.0
    return max(episode.duration + REST, swings)


def world(episode: Episode, *, log: str | None = None) -> World:
    """The run that the episode describes."""
    robot = ftqp.robots.load(episode.arm)
    latency = episode.latency * DT
    servo = {} if episode.drive == "torque" else {"bandwidth": BANDWIDTH}
    planner = ftqp.Planner(
        robot,
        DT,
        drive=Drive(kind=episode.drive, latency=latency, **servo),
        noise=Noise(q=episode.noise),
    )
    share = np.where(np.arange(robot.nv) >= robot.nv - WRISTS, 1.0 / 3.0, 1.0)
    weak = {robot.joints[episode.joint]: 0.3 * float(robot.limits.tau_max[episode.joint])}
    true = ftqp.TrueArm(
        payload=ftqp.Payload(episode.payload) if episode.payload else None,
        coulomb=dict(zip(robot.joints, (episode.friction * share).tolist(), strict=True)),
        brake=weak if episode.fault == "slipping brake" else None,
    )
    sensors = ftqp.JointSensors(
        robot, DT, latency=episode.latency, position_noise=episode.noise, seed=episode.seed
    )
    q = np.array(episode.start)
    path = ftqp.paths.Circle(
        robot.pose(q), episode.radius, axes=list(episode.plane), duration=episode.duration
    )
    arm = ftqp.MujocoPlant(robot, DT, ftqp.JointServo(robot, episode.drive), true)
    plant = Watched(arm, round(length(episode) / DT) + 1, robot.nv)
    run = Simulation(
        planner,
        path,
        q=q,
        plant=plant,
        sensors=sensors,
        schedule=ftqp.Schedule(_events(episode)),
        duration=length(episode),
        log=log,
    )
    return World(run, plant, path, robot, (planner.task.tolerance, planner.task.rotation_tolerance))


def _events(episode: Episode) -> list[ftqp.FaultEvent]:
    """What fails, and when the planner is told."""
    reported = {"at once": None, "late": episode.at + 0.05, "never": "never"}[episode.reported]
    kinds = {
        "locked": Locked(episode.joint),
        "locked at once": Locked(episode.joint, mode="instant", reset="momentum"),
        "free": FreeSwinging(episode.joint, damping=episode.damping),
        "degraded": Degraded(episode.joint, torque=0.6),
        "slipping brake": Locked(episode.joint),
    }
    if episode.fault == "none":
        return []
    return [ftqp.FaultEvent(episode.at, kinds[episode.fault], reported)]


def judged(episode: Episode) -> dict[str, Any]:
    """Runs the episode: how it ended, and by how much each law was broken (0.0 where it holds)."""
    there = world(episode)
    result = there.simulation.run()
    robot, states, codes = there.robot, there.plant.states, there.plant.codes
    t = DT * np.arange(len(codes))
    healthy = t[:, None] < DT * there.plant.braked
    if episode.fault not in ("none", "degraded"):
        healthy[t >= episode.at, episode.joint] = False
    broken = dict.fromkeys(LAWS, 0.0)
    speed = np.abs(states[:, 1]) / robot.limits.v_max
    if result.broken is not None or not np.isfinite(states[:, :2]).all():
        broken["divergence"] = 1.0
    counted = np.where(healthy & ~_impacts(episode, there, t)[:, None], speed, 0.0)
    fastest = float(counted.max(initial=0.0))
    broken["speed"] = fastest if fastest > SPEED_SLACK else 0.0
    over = np.argwhere(counted > SPEED_SLACK)
    k, i = over[0] if len(over) else (0, 0)
    led = float(abs(there.plant.asked[k, i]) / robot.limits.v_max[i])
    asked = float((np.abs(states[:, 2]) / robot.limits.tau_max).max())
    broken["torque"] = asked if not asked <= TORQUE_SLACK else 0.0
    final = STATUSES[int(codes[-1])]
    way = np.abs(states[OVER:, 0] - states[:-OVER, 0]) / (OVER * DT * robot.limits.v_max)
    moving = float(way[-200:][healthy[-200:]].max(initial=0.0))
    if not (final in ("OK", "STOPPED") or (final == "RELAXED" and moving < STILL)):
        broken["end"] = 1.0 + moving
    distance, turned = _errors(there, t, states[:, 0])
    wrong = ((distance > there.tolerance[0]) | (turned > there.tolerance[1])) & (
        codes == STATUSES.index("OK")
    )
    claimed = DT * _longest(wrong)
    broken["false OK"] = claimed if claimed > CLAIM else 0.0
    return {
        "status": final,
        "stopped_at": result.stopped_at,
        "error": 1e3 * float(distance[-1]),
        "moving": moving,
        "since": float(t[k]) - episode.at,
        "for": DT * len(np.unique(over[:, 0])),
        "led": led,
        **broken,
    }


def _impacts(episode: Episode, there: World, t: Array) -> Array:
    """Which samples are within IMPACT of a brake that closes or of a joint that meets its end stop, (K,)."""
    limits, q, braked = there.robot.limits, there.plant.states[:, 0], DT * there.plant.braked
    struck = np.zeros(len(t), dtype=np.bool_)
    for begin in braked[np.isfinite(braked)]:
        struck |= (t >= begin) & (t < begin + DT)
    if episode.fault in ("locked", "locked at once", "slipping brake"):
        struck |= (t >= episode.at) & (t < episode.at + DT)
    powerless = t[:, None] >= braked
    if episode.fault != "none":
        powerless[t >= episode.at, episode.joint] = True
    struck |= (((q > limits.q_max) | (q < limits.q_min)) & powerless).any(axis=1)
    return np.convolve(struck, np.ones(round(IMPACT / DT)))[: len(t)] > 0.5


def _errors(there: World, t: Array, q: Array) -> tuple[Array, Array]:
    """Distance [m] and angle [rad] from the true tip to the target of every tick, each (K,)."""
    arm, target = Arm(there.robot), there.path.sample(np.minimum(t, there.path.duration)).pose
    tip = np.array([arm.tip(now).copy() for now in q])
    trace = np.einsum("kij,kij->k", tip[:, :3, :3], target[:, :3, :3])
    turned = np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0))
    return np.linalg.norm(tip[:, :3, 3] - target[:, :3, 3], axis=1), turned


def _longest(wrong: Array) -> int:
    """The longest run of True."""
    ends = np.flatnonzero(~np.r_[False, wrong, False])
    return int(np.diff(ends).max(initial=1)) - 1


Row = tuple[int, dict[str, Any], dict[str, Any]]


def tables(found: dict[str, Any]) -> list[Table]:
    """How often each law was broken, by arm, drive and fault; how the runs ended; every exception."""
    rows: list[Row] = found["rows"]
    lines = [_counts("all", rows)]
    for key, values in (("arm", ARMS), ("drive", DRIVES), ("fault", FAULTS)):
        lines += [_counts(value, [row for row in rows if row[1][key] == value]) for value in values]
    failed = [row for row in rows if row[1]["fault"] != "none"]
    for when in REPORTED:
        lines.append(_counts(f"reported {when}", [row for row in failed if row[1]["reported"] == when]))
    broken = [_exception(row, law) for row in rows for law in LAWS if row[2][law] > 0.0]
    heads = ("episode", "what", "law", "by how much", "how it came about")
    return [
        Table(title="Broken laws", headings=("", "episodes", *LAWS, *ENDS), rows=lines),
        Table(title="Exceptions", headings=heads, rows=broken, text_last=True),
    ]


def _counts(name: str, rows: list[Row]) -> tuple[str, ...]:
    """A line of the first table."""
    broken = [sum(outcome[law] > 0.0 for _, _, outcome in rows) for law in LAWS]
    ends = [sum(outcome["status"] == end for _, _, outcome in rows) for end in ENDS]
    return name, *map(str, (len(rows), *broken, *ends))


def _exception(row: Row, law: str) -> tuple[str, ...]:
    """A line of the second table."""
    seed, drawn, outcome = row
    fault = f"joint {drawn['joint'] + 1} {drawn['fault']}, reported {drawn['reported']}"
    much, cause = f"{outcome[law]:.2f}", ""
    if law == "speed":
        much, cause = f"{much} for {outcome['for']:.3f} s", _cause(drawn, outcome)
    elif law == "end":
        much = f"{outcome['status']} at {outcome['moving']:.3f}"
    return str(seed), f"{drawn['arm']}, {drawn['drive']}, {fault}", law, much, cause


def _cause(drawn: dict[str, Any], outcome: dict[str, Any]) -> str:
    """How a joint came to be too fast, by when and at which command."""
    since, led = outcome["since"], outcome["led"]
    when = f"{since:.3f} s after the fault, commanded {led:.2f}"
    known = {"at once": 0.0, "late": 0.05, "never": np.inf}[drawn["reported"]]
    if since < 0.0 or drawn["fault"] == "none":
        return f"before any fault, commanded {led:.2f}"
    if since < JOLT:
        return f"jolt of the lost motor: {when}"
    return f"{'known' if since > known else 'unknown'} fault: {when}"


def measured(given: Any) -> dict[str, Any]:
    """Every episode: its number, what was drawn, and the outcome."""
    seeds = range(given.first, given.first + (2 if given.quick else given.episodes))
    return {"rows": Parallel(n_jobs=given.jobs)(delayed(_ran)(seed) for seed in seeds)}


def _ran(seed: int) -> Row:
    logging.getLogger("ftqp").setLevel(logging.ERROR)
    episode = draw(seed)
    return seed, asdict(episode), judged(episode)


def replay(seed: int) -> None:
    """One episode, in words and figures."""
    from ftqp.viz.figures.run_figures import save_figures

    episode = draw(seed)
    print(episode)
    print(judged(episode))
    log = world(episode, log="memory").simulation.run().log
    assert log is not None
    for file in save_figures(log, Path(f"runs/campaign-physics-{seed}")):
        print(file)


if __name__ == "__main__":
    parser = study.options(__doc__, "campaign_physics", "two episodes")
    parser.add_argument("--episodes", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="number of the first episode")
    parser.add_argument("--jobs", type=int, default=1, help="how many processes run them")
    parser.add_argument("--replay", type=int, help="run this episode alone, with figures")
    given = parser.parse_args()
    if given.replay is None:
        quick = given.quick or given.episodes < WHOLE
        study.on_record(given, "Episodes in physics", measured, tables, LIMITATIONS, quick=quick)
    else:
        replay(given.replay)
