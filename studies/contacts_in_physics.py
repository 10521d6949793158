"""Arms past boxes in MuJoCo, where bodies collide: how often an arm touches something, and how hard.

An arm follows a line of 0.15 to 0.35 m, or goes to a pose, past boxes from which it is clear where it
begins. A joint fails on the way: its brake closes, it swings free, or it loses speed and torque; the planner
is told up to 50 ms later. The true arm has other masses, rotors and friction than the model, and positions
are measured with noise. Each episode is run twice: by a planner that knows nothing of the boxes, and by one
that was given them.

    python studies/contacts_in_physics.py                       500 lines and 500 goals
    python studies/contacts_in_physics.py --episodes 20 --seed 7
"""

import sys
from typing import NamedTuple

import numpy as np
from bench import study
from bench.tables import Table

import ftqp

ARMS = ("panda", "iiwa14")
DT, SECONDS, SUBSTEPS = 2e-3, 4.5, 6
KEEP, CLEAR = 0.02, 0.05
"""The clearance that is asked for, and that of the posture in which an arm begins [m]."""
NOISE, LATE = 1e-4, 0.05
"""Standard deviation of positions [rad], and how late the planner is told at most [s]."""
KINDS = ("brake", "free", "weak", "none")
LEAST = 1e-3
"""A force from here on is a touch [N]."""


class Episode(NamedTuple):
    """What is run twice."""

    robot: ftqp.Robot
    q0: np.ndarray
    goal: object
    scene: ftqp.Scene
    kind: str
    fault: object
    at: int
    told: int
    true: ftqp.TrueArm
    seed: int


def fault_of(kind, joint):
    """What happens to a joint."""
    match kind:
        case "brake":
            return ftqp.Locked(joint)
        case "free":
            return ftqp.FreeSwinging(joint)
        case "weak":
            return ftqp.Degraded(joint, velocity=0.4, acceleration=0.5, torque=0.7)
        case _:
            return None


def run(one: Episode, scene):
    """Worst force, when it first touched, its distance at the failure, last status and final error."""
    robot = one.robot
    goes = isinstance(one.goal, np.ndarray)
    planner = ftqp.Planner(
        robot, DT, task=ftqp.Task(mode="slack" if goes else "scaled"), drive="position",
        noise=ftqp.Noise(q=NOISE), scene=scene,
        clearance=None if scene is None else ftqp.Clearance(keep=KEEP),
    )  # fmt: skip
    plant = ftqp.MujocoPlant(
        robot, DT, ftqp.JointServo(robot), one.true, substeps=SUBSTEPS, scene=one.scene, seed=one.seed
    )
    sensors = ftqp.JointSensors(robot, DT, position_noise=NOISE, velocity_noise=10.0 * NOISE, seed=one.seed)
    plant.reset(one.q0, np.zeros(robot.nv))
    planner.reset(one.q0)
    leads = ftqp.GoTo(planner, pose=one.goal) if goes else ftqp.PathFollower(planner, one.goal)
    worst, first, begun = 0.0, -1, np.inf
    for k in range(round(SECONDS / DT)):
        if k == one.at and one.fault is not None:
            plant.fail(one.fault)
        if k == one.told and one.fault is not None:
            planner.report(one.fault)
        sensors.measure(plant.q, plant.v)
        step = leads.step(sensors.q, sensors.v)
        if k == one.at:
            begun = step.clearance
        plant.advance(step)
        force = plant.contact_force
        if force > LEAST and first < 0:
            first = k
        worst = max(worst, force)
    return worst, first, begun, step.status.name, step.position_error


def draw(rng, what, robots):
    """An episode; None where the arm does not begin clear of everything."""
    robot = robots[int(rng.integers(len(robots)))]
    limits = robot.limits
    q0 = limits.q_min + (limits.q_max - limits.q_min) * (0.2 + 0.6 * rng.random(robot.nv))
    T = robot.pose(q0)
    if not (0.25 < np.linalg.norm(T[:2, 3]) < 0.75 and T[2, 3] > 0.15):
        return None
    way = rng.normal(size=3)
    way *= rng.uniform(0.15, 0.35) / np.linalg.norm(way)
    goal = T.copy()
    goal[:3, 3] += 1.5 * way
    if what == "goals" and (np.linalg.norm(goal[:3, 3]) > 0.75 or goal[2, 3] < 0.1):
        return None
    scene = ftqp.Scene()
    for k in range(3):
        along = T[:3, 3] + way * rng.uniform(0.2, 1.0) + rng.normal(size=3) * 0.15
        scene.add(
            f"box {k + 1}", ftqp.Box(rng.uniform(0.06, 0.25, size=3), along, rpy=rng.uniform(-1.0, 1.0, 3))
        )
    tips = [robot.pose(q0, name)[:3, 3] for name in (*robot.joints, robot.tip)]
    if min(float(np.linalg.norm(tip - box.place[:3, 3])) for tip in tips for box in scene.values()) < CLEAR:
        return None  # certainly inside
    sees = ftqp.Planner(robot, DT, scene=scene, clearance=ftqp.Clearance(keep=KEEP))
    if min(map(float, sees.distances(q0).values())) < CLEAR:
        return None
    if what == "lines":
        goal = ftqp.paths.Line(T, tuple(way), duration=rng.uniform(1.5, 3.0))
    kind = KINDS[int(rng.choice(4, p=[0.5, 0.15, 0.2, 0.15]))]
    at = int(rng.uniform(0.2, 1.5) / DT)
    true = ftqp.TrueArm(
        mass_scale=rng.uniform(0.9, 1.1), rotors=rng.uniform(0.0, 0.3), coulomb=rng.uniform(0.0, 0.5),
        viscous=rng.uniform(0.0, 1.0), brake_delay=rng.uniform(0.0, 0.05),
    )  # fmt: skip
    return Episode(
        robot, q0, goal, scene, kind, fault_of(kind, robot.joints[int(rng.integers(robot.nv))]), at,
        at + int(rng.uniform(0.0, LATE) / DT), true, int(rng.integers(1 << 31)),
    )  # fmt: skip


def measured(count, seed, verbose):
    """A row for each kind of motion and of failure."""
    rows, robots = [], [ftqp.robots.load(name) for name in ARMS]
    for number, what in enumerate(("lines", "goals")):
        rng, done = np.random.default_rng([seed, number]), 0
        found = {kind: [] for kind in KINDS}
        while done < count:
            one = draw(rng, what, robots)
            if one is None:
                continue
            done += 1
            blind, seeing = run(one, None), run(one, one.scene)
            found[one.kind].append((blind[0] > LEAST, seeing[0] > LEAST, seeing[0]))
            if verbose and seeing[0] > LEAST:
                print(what, done, one.robot.name, one.kind, one.fault, one.at, one.told, seeing, flush=True)
        for kind, cases in found.items():
            if cases:
                blind, seeing, force = np.array(cases).T
                rows.append({
                    "motion": what, "failure": kind, "episodes": len(cases),
                    "touch without": int(blind.sum()),
                    "touch with": int(seeing.sum()), "largest force with [N]": round(float(force.max()), 1),
                })  # fmt: skip
    return rows


def tables(found):
    """A row for each kind of motion and of failure."""
    named = list(found["rows"][0])
    lines = [tuple(str(row[name]) for name in named) for row in found["rows"]]
    notes = (
        f"Three boxes beside the way, `Clearance(keep={KEEP:g})`, arms that begin {1e3 * CLEAR:g} mm clear.",
        "The true arm has up to 10 % other masses, rotors up to 0.3 kg m2, dry friction up to 0.5 N m, "
        f"brakes that take up to 50 ms; positions are measured with {NOISE:g} rad; the planner is told up to "
        f"{1e3 * LATE:g} ms late.",
    )
    return [
        Table(title="Episodes in which an arm touches something", headings=named, rows=lines, notes=notes)
    ]


LIMITATIONS = (
    "Bodies that collide are the capsules of the links; boxes stand still; a joint that swings free falls as "
    "it may, and no planner holds what hangs on it.",
)


def main() -> int:
    """Writes a table: 0 when no arm with a scene touched anything but those with a joint that swings free."""
    parser = study.options(__doc__, "contacts_in_physics", "20 of each motion")
    parser.add_argument("--episodes", type=int, default=500, help="of each motion (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--verbose", action="store_true", help="a line for every episode that touches")
    given = parser.parse_args()
    count = 20 if given.quick else given.episodes
    found = study.on_record(
        given, "Arms past boxes in MuJoCo",
        lambda given: {"rows": measured(count, given.seed, given.verbose)}, tables, LIMITATIONS,
        quick=count < 500,
    )  # fmt: skip
    return int(any(row["touch with"] for row in found["rows"] if row["failure"] != "free"))


if __name__ == "__main__":
    sys.exit(main())
