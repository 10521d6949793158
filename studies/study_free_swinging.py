"""What becomes of an arm one of whose joints swings freely: robots x joints x postures x friction.

    python studies/study_free_swinging.py --seed 3   the table of docs/evidence, twenty minutes
    python studies/study_free_swinging.py --at-rest --drawn 9 --dampings 0.5 --postures 20
    python studies/study_free_swinging.py --quick --robots panda --joints 3 4

Each run begins in a random posture with the tip in motion. The joint fails at once and is announced, the
target brakes the tip in 0.4 s and stands; 4 s at 1 kHz on the arm of the simulation, whose end stops are at
the range and plastic. Beside the planner the same arm only brakes.

kept: what the planner decided to keep was kept: no stop, no healthy joint more than 2 % too fast, the tip
within 5 mm of its place in the end. hits: the free joint met a stop. swept: the farthest that the origin of
a joint, or the tip, went from where it was. Report and numbers go to ``--out``.
"""

import logging
import time
from dataclasses import asdict, dataclass
from types import SimpleNamespace

import numpy as np
from bench import study
from bench.tables import Table
from joblib import Parallel, delayed

import ftqp
from ftqp.kernel.layout.enums import ARREST, FOLLOW, HOLD, STILL
from ftqp.sim.plants.plant import Arm

DT = 1e-3
BRAKING = 0.4
ROBOTS = ("panda", "iiwa14", "xarm7")
DAMPINGS = (0.0, 0.5, 3.0)
LIMITATIONS = (
    "Starts are regular postures in the middle 80 % of the ranges, at up to half of the speed limits.",
    "Ten postures an entry: a share is known to 10 %, and a mean impact rests on a few hits.",
    "The fault is announced at once and its friction is known; the simulated arm's samples are exact.",
)


@dataclass
class Run:
    """One run, and the same arm that only brakes."""

    robot: str
    joint: int
    damping: float
    posture: int
    decided: str
    kept: bool
    gave_up: float | None
    hit: float
    energy: float
    swept: float
    hit_braking: float
    energy_braking: float
    swept_braking: float
    stopped: float | None
    overspeed: float
    torque: float
    deviation: float
    tip_end: float
    step_us: float


def drawn(name):
    """An arm of the catalog, or by a number one that is in no catalog: such an arm with other inertia."""
    if not name.isdigit():
        return ftqp.robots.load(name)
    rng = np.random.default_rng(int(name))
    base = ftqp.robots.load(ROBOTS[int(name) % len(ROBOTS)])
    load = ftqp.Payload(rng.uniform(0.2, 3.0), (0.0, 0.0, rng.uniform(0.0, 0.15)))
    return base.with_rotors(rng.uniform(0.0, 0.3, base.nv)).with_payload(load)


def start(robot, rng, at_rest=False):
    """A posture in the middle 80 % of the range and a speed, far from singular."""
    low, high = robot.limits.q_min, robot.limits.q_max
    arm = Arm(robot)
    while True:
        q = low + (high - low) * rng.uniform(0.1, 0.9, robot.nv)
        arm.tip(q)
        J = arm._session.K.kinematics.J[:, : robot.nv].copy()
        J[3:] *= 0.15
        if np.linalg.svd(J, compute_uv=False)[-1] / 0.15 < 0.15:
            continue
        if at_rest:
            return q, np.zeros(robot.nv)
        direction = rng.normal(size=3)
        twist = np.zeros(6)
        twist[:3] = rng.uniform(0.1, 0.25) * direction / np.linalg.norm(direction)
        v = np.linalg.pinv(J) @ twist
        if (np.abs(v) <= 0.5 * robot.limits.v_max).all():
            return q, v


class Physics:
    """The arm in MuJoCo, driven by torques, its stops at the range; it tells of impacts as the other does."""

    def __init__(self, robot):
        from ftqp.sim.plants.joint_servo import JointServo
        from ftqp.sim.plants.mujoco_plant import MujocoPlant
        from ftqp.sim.plants.true_arm import TrueArm

        self.robot = robot
        self._plant = MujocoPlant(robot, DT, JointServo(robot, "torque"), TrueArm(end_stops=0.0))
        self.q, self.v, self.impacts, self._joint = self._plant.q, self._plant.v, (), None

    def reset(self, q, v):
        self._plant.reset(q, v)

    def fail(self, fault):
        self._plant.fail(fault)
        self._joint = fault.joint

    def advance(self, command):
        i, limits = self._joint, self.robot.limits
        before = float(self.v[i])
        self._plant.advance(command)
        after, room = float(self.v[i]), min(self.q[i] - limits.q_min[i], limits.q_max[i] - self.q[i])
        if room < 0.01 and abs(before) > 0.05 and abs(after) < 0.5 * abs(before):
            self.impacts = (*self.impacts, SimpleNamespace(speed=abs(before)))


PLANTS = {"kinematic": lambda robot: ftqp.KinematicPlant(robot, DT), "mujoco": Physics}


def braking(robot, joint, damping, q, v, ticks, physics):
    """Largest impact speed, its energy, and how far links go when the others only brake."""
    plant, arm = PLANTS[physics](robot), Arm(robot)
    plant.reset(q, v)
    plant.fail(ftqp.FreeSwinging(joint, damping=damping))
    return impact_of(plant, arm, joint, (brake(robot, plant, arm, joint, damping) for _ in range(ticks)))


def brake(robot, plant, arm, i, damping):
    """The command with which every joint brakes as hard as it can, and the torques for it."""
    a = np.clip(-plant.v / DT, -robot.limits.a_max, robot.limits.a_max)
    M, h = arm.dynamics(plant.q, plant.v)
    a[i] = 0.0
    at_stop = min(plant.q[i] - robot.limits.q_min[i], robot.limits.q_max[i] - plant.q[i]) < 1e-3
    a[i] = 0.0 if at_stop else -(h[i] + M[i] @ a + damping * plant.v[i]) / M[i, i]
    return SimpleNamespace(
        q=plant.q + DT * plant.v + 0.5 * DT**2 * a,
        v=plant.v + DT * a,
        tau=M @ a + h,
        brakes=np.zeros(len(a), bool),
    )


def impact_of(plant, arm, joint, commands):
    speed = energy = swept = 0.0
    places = links_of(arm, plant.q)
    for command in commands:
        known = len(plant.impacts)
        q, v = plant.q.copy(), plant.v.copy()
        plant.advance(command)
        for hit in plant.impacts[known:]:
            if hit.speed > speed:
                M, _ = arm.dynamics(q, v)
                speed, energy = hit.speed, 0.5 * M[joint, joint] * hit.speed**2
        swept = max(swept, float(np.linalg.norm(links_of(arm, plant.q) - places, axis=1).max()))
    return speed, energy, swept


def links_of(arm, q):
    """Where the origins of the joints and the tip are, (n + 1, 3) [m]."""
    arm.tip(q)
    seen = arm._session.K.kinematics
    return np.vstack([seen.o[: len(q)], seen.o_tip])


def one(name, robot, joint, damping, posture, q0, v0, seconds, physics):
    ticks = round(seconds / DT)
    plant, arm = PLANTS[physics](robot), Arm(robot)
    planner = ftqp.Planner(robot, DT, drive="torque" if physics == "mujoco" else "position")
    fault = ftqp.FreeSwinging(joint, damping=damping)
    plant.reset(q0, v0)
    planner.reset(q0, v0)
    plant.fail(fault)
    planner.report(fault)
    pose = arm.tip(q0).copy()
    J = arm._session.K.kinematics.J[:3, : robot.nv].copy()
    tip_v = J @ v0
    goal = pose[:3, 3] + 0.5 * BRAKING * tip_v
    seen = SimpleNamespace(rows=(), gave_up=None, stopped=None, over=0.0, torque=0.0, far=0.0, slow=0.0)
    limits, healthy = robot.limits, np.arange(robot.nv) != joint

    def commands():
        for k in range(ticks):
            t = min(k * DT, BRAKING)
            now = pose.copy()
            now[:3, 3] += tip_v * (t - 0.5 * t * t / BRAKING)
            twist, acceleration = np.zeros(6), np.zeros(6)
            if k * DT < BRAKING:
                twist[:3], acceleration[:3] = tip_v * (1 - t / BRAKING), -tip_v / BRAKING
            target = ftqp.Target(pose=now, twist=twist, acceleration=acceleration)
            began = time.thread_time()
            step = planner.step(plant.q, plant.v, target)
            if k > 2:
                seen.slow = max(seen.slow, time.thread_time() - began)
            mode = planner._session.K.free.mode
            if mode in (HOLD, FOLLOW) and not seen.rows:
                seen.rows = step.rows
            if mode in (ARREST, STILL) and seen.gave_up is None:
                seen.gave_up = k * DT
            if step.status.name == "STOPPED" and seen.stopped is None:
                seen.stopped = k * DT
            if not plant.impacts:
                seen.over = max(seen.over, (np.abs(plant.v) / limits.v_max)[healthy].max())
                seen.torque = max(seen.torque, (np.abs(step.tau) / limits.tau_max)[healthy].max())
            seen.far = max(seen.far, np.linalg.norm(arm.tip(plant.q)[:3, 3] - goal))
            yield step

    hit = impact_of(plant, Arm(robot), joint, commands())
    end = float(np.linalg.norm(arm.tip(plant.q)[:3, 3] - goal))
    brakes = braking(robot, joint, damping, q0, v0, ticks, physics)
    kept = bool(seen.rows) and seen.gave_up is None and not plant.impacts
    kept = kept and seen.over <= 1.02 and end <= 0.005
    decided = {6: "pose", 5: "axis", 3: "position", 0: "none"}[len(seen.rows)]
    return Run(name, joint + 1, damping, posture, decided, kept, seen.gave_up, *hit, *brakes,
               seen.stopped, seen.over, seen.torque, seen.far, end, 1e6 * seen.slow)  # fmt: skip


def by_joint(runs):
    """The table of the docs, a line for each arm and joint."""
    dampings = sorted({r.damping for r in runs})
    heads = [f"{what}, d = {d:g}" for d in dampings for what in ("kept [%]", "hits [%]", "impact [rad/s]")]
    lines = []
    for robot in dict.fromkeys(r.robot for r in runs):
        for joint in [*sorted({r.joint for r in runs if r.robot == robot}), "all"]:
            own = [r for r in runs if r.robot == robot and joint in (r.joint, "all")]
            entries = [_entry([r for r in own if r.damping == d]) for d in dampings]
            lines.append((robot, str(joint), *(cell for entry in entries for cell in entry)))
    note = "Impacts are means: of an arm that only brakes > of the planner's."
    return Table(
        title=f"{len(runs)} runs", headings=("robot", "joint", *heads), rows=lines, notes=(note, *laws(runs))
    )


def _entry(runs):
    kept, hits = (round(100 * np.mean(x)) for x in ([r.kept for r in runs], [r.hit > 0 for r in runs]))
    return str(kept), str(hits), f"{_mean(runs, 'hit_braking'):.1f} > {_mean(runs, 'hit'):.1f}"


def _mean(runs, name):
    return float(np.mean([getattr(run, name) for run in runs]))


def by_rows(runs):
    """What was kept apart by sets of rows, and the energies."""
    lines = []
    for robot, joint, d in dict.fromkeys((r.robot, r.joint, r.damping) for r in runs):
        group = [r for r in runs if (r.robot, r.joint, r.damping) == (robot, joint, d)]
        kept = [sum(r.kept and r.decided == rows for r in group) for rows in ("pose", "axis", "position")]
        hits = sum(r.hit > 0.0 for r in group)
        shares = [round(100 * x / len(group)) for x in (*kept, len(group) - sum(kept) - hits, hits)]
        energy = f"{_mean(group, 'energy_braking'):.1f} > {_mean(group, 'energy'):.1f}"
        lines.append((robot, str(joint), f"{d:g}", *map(str, shares), energy))
    heads = ("robot", "joint", "d", "pose [%]", "axis [%]", "position [%]", "none [%]", "hits [%]")
    return Table(title="Rows", headings=(*heads, "energy, braking > planner [J]"), rows=lines)


def laws(runs):
    """What of the laws can be seen, (lines)."""
    yes = [r for r in runs if r.decided != "none"]
    wrong = [r for r in yes if not r.kept]
    others = [r for r in yes if r.joint != 1]
    worse = [r for r in runs if r.hit > r.hit_braking + 0.05]
    fast = [r for r in runs if r.overspeed > 1.02]
    strong = [r for r in runs if r.torque > 1.0 + 1e-6]
    given = [r for r in runs if r.gave_up is not None and r.damping >= 0.5]
    took = [np.inf if r.stopped is None else r.stopped - (r.gave_up if r.gave_up > 0.1 else 0) for r in given]
    ended = [time for time in took if np.isfinite(time)]
    slow = [r.step_us for r in runs]
    wide = [r for r in runs if r.swept > r.swept_braking + 0.02]
    poor = [r for r in wide if r.energy > r.energy_braking - 10.0]
    far = [r for r in poor if not r.kept or r.swept > r.swept_braking + 0.12]
    return [
        f"1. A healthy joint was more than 2 % too fast before an impact in {len(fast)} of {len(runs)} runs, "
        f"a torque beyond its limit in {len(strong)}.",
        f"2. The impact was harder than that of braking by more than 0.05 rad/s in {len(worse)} runs"
        + "".join(
            f"; {r.robot}, joint {r.joint}, d = {r.damping:g}: {r.hit_braking:.2f} > {r.hit:.2f}"
            for r in worse
        )
        + ".",
        f"3. Of {len(given)} runs with d >= 0.5 that were given up {sum(x > 1.5 for x in took)} were not "
        f"STOPPED within 1.5 s; the latest that stopped took {max(ended, default=0.0):.2f} s.",
        f"4. The decision said yes {len(yes)} times and was wrong {len(wrong)} times, {len(others)} and "
        f"{sum(not r.kept for r in others)} times without the first joints; of the {len(wrong)} "
        f"{sum(r.gave_up is not None for r in wrong)} were given up later and "
        f"{sum(r.hit > 0 for r in wrong)} met a stop.",
        f"5. The slowest step of a run took {np.median(slow):.0f} us in the median, "
        f"{np.quantile(slow, 0.9):.0f} us in the slowest tenth and {max(slow):.0f} us at most (thread time).",
        f"6. Links went more than 2 cm farther than if the others had braked in {len(wide)} runs, in "
        f"{len(poor)} of them for less than 10 J; of those {len(poor) - len(far)} kept a part of the task "
        "and went at most 12 cm farther"
        + "".join(
            f"; {r.robot}, joint {r.joint}, d = {r.damping:g}: {r.swept_braking:.2f} > {r.swept:.2f} m for "
            f"{r.energy_braking:.1f} > {r.energy:.1f} J"
            for r in far
        )
        + ".",
    ]


def tables(found):
    """Both tables, and what of the laws can be seen."""
    runs = [Run(**row) for row in found["rows"]]
    return [by_joint(runs), by_rows(runs)]


def joint_runs(name, joint, seed, postures, dampings, seconds, physics, at_rest):
    """All runs of one joint of an arm, as dictionaries."""
    logging.getLogger("ftqp").setLevel(logging.ERROR)
    robot = drawn(name)
    rng = np.random.default_rng([seed, joint])
    starts = [start(robot, rng, at_rest) for _ in range(postures)]
    return [
        asdict(one(name, robot, joint - 1, damping, posture, q, v, seconds, physics))
        for damping in dampings
        for posture, (q, v) in enumerate(starts)
    ]


def measured(given):
    """All runs of all arms."""
    if given.quick:
        given.postures, given.dampings = 2, [0.5]
    drawn = given.seed, given.postures, given.dampings, given.seconds, given.physics, given.at_rest
    work = [
        delayed(joint_runs)(name, joint, *drawn)
        for name in (*given.robots, *map(str, range(given.drawn)))
        for joint in given.joints
    ]
    return {"rows": [row for rows in Parallel(n_jobs=given.jobs)(work) for row in rows]}


if __name__ == "__main__":
    parser = study.options(__doc__, "study_free_swinging", "two postures, d = 0.5 only")
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS))
    parser.add_argument("--joints", nargs="+", type=int, default=list(range(1, 8)), help="from 1")
    parser.add_argument("--dampings", nargs="+", type=float, default=list(DAMPINGS))
    parser.add_argument("--postures", type=int, default=10)
    parser.add_argument("--seed", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--physics", choices=sorted(PLANTS), default="kinematic")
    parser.add_argument("--jobs", type=int, default=1, help="how many processes run them")
    parser.add_argument("--at-rest", action="store_true", help="arms begin at rest")
    parser.add_argument("--drawn", type=int, default=0, help="so many arms that are in no catalog, too")
    given = parser.parse_args()
    study.on_record(
        given, "What becomes of an arm with a free-swinging joint", measured, tables, LIMITATIONS,
        quick=given.quick or given.at_rest or given.physics != "kinematic",
    )  # fmt: skip
