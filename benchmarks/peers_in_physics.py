"""pink, placo, mink, OInK and resolved rates on the arm of the demo, in physics, lock reported or not.

    python benchmarks/peers_in_physics.py           every joint, a box in the way, eight goals: an hour
    python benchmarks/peers_in_physics.py --jobs 4  the same in four processes
    python benchmarks/peers_in_physics.py --quick   the demo's joint, the box, one goal
    python benchmarks/peers_in_physics.py --own     ftqp alone, a minute or two
    python benchmarks/peers_in_physics.py --env-dir DIR   where the peers are, or are installed

A Panda behind servos of 15 Hz in MuJoCo, with gravity and noisy encoders. First it goes round the circle of
`panda-unannounced` while the brake of one joint closes. Then the same with a box where the elbow goes after
the lock of joint 3. Then it goes to poses that need another posture once a joint is locked.
All peers are wired well: they solve at the measured joints with feedback and the target's twist, a radian of
the tip weighs what it weighs for ftqp (``robot.length``), and their speeds are integrated to what the servos
are sent, within range, speed and acceleration. When a lock is reported, they take that joint out. Each is
tried with three gains in every row, on every joint and on the way to every goal, and the one that strays
least there in these weights is published, as nobody could know it before. Rows in which a peer is as good or
better are published like all others, and the best of each row is bold.
"""

import argparse
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from itertools import repeat
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
from bench import command_line, docs  # noqa: E402
from bench.attitude import turned  # noqa: E402
from bench.results import circumstances  # noqa: E402
from bench.tables import Table  # noqa: E402
from bench.wrapped_plant import WrappedPlant  # noqa: E402
from bench_collisions import rods_of  # noqa: E402
from compare_peers import drawn, feasible  # noqa: E402
from peers.peer_rival import PeerRival  # noqa: E402
from peers.servant import Charge  # noqa: E402
from steps.environments import DEFAULT, NotInstalled  # noqa: E402

import ftqp  # noqa: E402
from ftqp.app.scenario.setup import load  # noqa: E402
from ftqp.sim.rival import ResolvedRates, ride, strayed  # noqa: E402

SCENARIO, DEMO = "panda-unannounced", "panda_joint3"
GAINS = (60.0, 30.0, 120.0)
"""Feedback of the rivals [1/s]: that of `studies/well_wired.py`, half and twice it."""
BOX = (0.12, 0.12, 0.12, -0.2, -0.3, 0.5)
"""Edges and middle [m]: the elbow would come to stand in it after the lock of joint 3, and not before."""
KEEP = 0.02
GOALS, RESTARTS, BRAKES_AT, GOAL_DT, BANDWIDTH, NOISE = 8, 500, 0.2, 2e-3, 94.0, 1e-4
STOPPED = {"STOPPED", "STOPPING"}
ARRIVED, TURNED = 2e-3, 2e-2
"""A goal counts as reached within these at the end [m, rad]."""
RIVALS = (("resolved rates", None), ("pink", "pink"), ("placo", "placo"), ("mink", "mink"), ("OInK", "oink"))
SEE_THE_BOX = (None, "pink", "mink")
"""Who rides past the box; resolved rates do not know of it."""
LIMITATIONS = (
    "Peers are wired by us; their authors may know better.",
    "placo and mink have no limit of acceleration; speeds of all peers are held to it afterwards.",
    "pink knows of the box by its barrier, mink by its limit; resolved rates do not; placo and OInK are left "
    "out there, as theirs are for bodies of the URDF.",
    "Peers and resolved rates are led along the straight line to a goal; none of them claims to do more.",
    "ftqp's detector has its defaults; one arm, one noise, one servo, no delay.",
)


class Felt(WrappedPlant):
    """A plant that remembers the hardest contact [N]."""

    force = 0.0

    def advance(self, command) -> None:
        """Moves on."""
        self._plant.advance(command)
        self.force = max(self.force, self._plant.contact_force)


@contextmanager
def leading(rival, robot, q, dt: float, env_dir: Path, box=()) -> Iterator:
    """The rival of an entry of `RIVALS`, ready to lead a robot from q.

    Raises:
        NotInstalled: Its environment cannot be made.
    """
    _, peer, gain = rival
    if peer is None:
        yield ResolvedRates(robot, dt, gain=gain)
        return
    limits = [robot.limits.q_min, robot.limits.q_max, robot.limits.v_max, robot.limits.a_max]
    charge = Charge(
        urdf=robot.to_urdf(), tip=robot.tip, joints=list(robot.joints), q=np.array(q).tolist(),
        limits=[row.tolist() for row in limits], dt=dt, gain=gain, length=robot.length, fed_back=True,
        rods=rods_of(robot) if box else [], box=list(box), keep=KEEP,
    )  # fmt: skip
    with PeerRival(peer, robot, charge, env_dir) as found:
        yield found


def choices(joint: str, told: bool, box: bool) -> list[str]:
    """What differs from the bundled scenario."""
    found = [f"faults.0.joint={joint}", f"faults.0.announced={'' if told else 'never'}"]
    if box:
        place = f"size=[{BOX[0]}, {BOX[1]}, {BOX[2]}], place=[{BOX[3]}, {BOX[4]}, {BOX[5]}]"
        found += [f'scene=[{{kind="box", {place}}}]', f"clearance={{keep={KEEP}, self_pairs=false}}"]
    return found


def facts(program: str, joint: str, told: bool, log, said: str = "") -> dict[str, object]:
    """A row: t, error, target poses, q and v of a run whose joint broke come to figures."""
    t, error, poses, q, v, at, robot = log
    since, turn = error[t >= at], turned(robot, q, poses)[t >= at]
    return {
        "program": program, "joint": joint, "told": told, "before": float(error[t < at].max()),
        "after": float(since.max()), "end": float(since[-1]),
        "turned": float(turn.max()), "turned_end": float(turn[-1]),
        "weighted": float(np.hypot(since, robot.length * turn).max()),
        "speed": float((np.abs(v) / robot.limits.v_max).max()), "said": said, "q": q,
    }  # fmt: skip


def own(joint: str, told: bool, box: bool) -> dict[str, object]:
    """ftqp round the circle."""
    setup = load(SCENARIO, choices(joint, told, box))
    result = setup.simulation(log="memory").run()
    (event,), log = setup.schedule, result.log
    poses = setup.path.sample(log["t"]).pose
    run = (log["t"], strayed(log), poses, log["q"], log["v"], event.at, setup.robot)
    return facts("ftqp", joint, told, run, result.final_status.name)


def rivals_row(
    rival, joint: str, told: bool, box: bool, env_dir: Path
) -> tuple[dict[str, object], float, dict]:
    """A rival round the circle, its hardest contact and its versions."""
    setup = load(SCENARIO, choices(joint, told, box))
    (event,), plant = setup.schedule, Felt(setup.plant)
    with leading(rival, setup.robot, setup.q, setup.planner.dt, env_dir, BOX if box else ()) as leads:
        done = ride(
            leads, setup.robot, setup.path, setup.q, dt=setup.planner.dt, plant=plant,
            sensors=setup.sensors, schedule=setup.schedule, reported=told,
        )  # fmt: skip
        versions = getattr(leads, "versions", {})
    run = (done.t, done.error, setup.path.sample(done.t).pose, done.q, done.v, event.at, setup.robot)
    return facts(rival[0], joint, told, run) | {"gain": rival[2]}, plant.force, versions


def nearest(q) -> float:
    """How near the arm came to the box [m]; capsules that stand before the first joint do not count."""
    robot = ftqp.robots.load("panda")
    scene = ftqp.Scene()
    scene.add("box", ftqp.Box(BOX[:3], BOX[3:]))
    planner = ftqp.Planner(
        robot, scene=scene, clearance=ftqp.Clearance(keep=KEEP, self_pairs=False),
    )  # fmt: skip
    return min(min(planner.distances(one).values()) for one in q[::10])


def goals(count: int):
    """Goals of a Panda that a locked joint leaves in reach by another posture only."""
    found, k = [], 0
    while len(found) < count:
        case, arm = drawn("panda", "goal", k)
        k += 1
        if feasible(case, arm, RESTARTS) == "other posture":
            found.append(case)
            command_line.say(f"goal {len(found)} of {count}")
    return found


def to_goal(case, program, told: bool, env_dir: Path) -> dict[str, float]:
    """Where an arm in physics ends after the brake of the case's joint has closed."""
    robot, q, goal = ftqp.robots.load("panda"), np.array(case.q), np.array(case.goal)
    at, seconds = round(BRAKES_AT / GOAL_DT), case.duration + case.rest
    plant = ftqp.MujocoPlant(robot, GOAL_DT, ftqp.JointServo(robot, bandwidth=BANDWIDTH), substeps=6)
    sensors = ftqp.JointSensors(robot, GOAL_DT, position_noise=NOISE)
    lock = ftqp.Locked(robot.joints[case.locked])
    if program == "ftqp":
        planner = ftqp.Planner(
            robot, GOAL_DT, drive=ftqp.Drive(kind="position", bandwidth=BANDWIDTH), noise=ftqp.Noise(q=NOISE),
            detector=ftqp.Detector(),
        )  # fmt: skip
        planner.reset(q)
        plant.reset(q, np.zeros(robot.nv))
        leads = ftqp.GoTo(planner, pose=goal)
        for k in range(round(seconds / GOAL_DT)):
            if k == at:
                plant.fail(lock)
                if told:
                    planner.report(lock)
            sensors.measure(plant.q, plant.v)
            plant.advance(leads.step(sensors.q, None))
        end = plant.q
    else:
        path = ftqp.paths.PointToPoint(np.array(case.start), goal, duration=case.duration)
        schedule = ftqp.Schedule([ftqp.FaultEvent(BRAKES_AT, lock)])
        with leading(program, robot, q, GOAL_DT, env_dir) as rival:
            world = {"plant": plant, "sensors": sensors, "schedule": schedule, "duration": seconds}
            end = ride(rival, robot, path, q, dt=GOAL_DT, reported=told, **world).q[-1]
    T = robot.pose(end)
    turned = np.arccos(np.clip(0.5 * (np.trace(T[:3, :3].T @ goal[:3, :3]) - 1.0), -1.0, 1.0))
    off = float(np.linalg.norm(T[:3, 3] - goal[:3, 3]))
    return {"off": off, "turned": float(turned), "weighted": float(np.hypot(off, robot.length * turned))}


def ridden(job, env_dir: Path) -> tuple[dict[str, object], dict]:
    """What a program did round the circle, past the box or not, and its versions."""
    program, joint, told, box = job
    if program == "ftqp":
        row, force, versions = own(joint, told, box), 0.0, {}
    else:
        row, force, versions = rivals_row(program, joint, told, box, env_dir)
    if box:
        near = nearest(row["q"])
        row |= {"near": near, "force": float("inf") if program == "ftqp" and near <= 0.0 else force}
    del row["q"]
    return row, versions


def led(job, env_dir: Path) -> dict[str, float]:
    """Where a program ended that was led to a goal."""
    return to_goal(*job, env_dir)


def wired(program) -> list:
    """A program with every gain that it is tried with; ftqp has none."""
    return [program] if program == "ftqp" else [(*program, gain) for gain in GAINS]


def best(rows):
    """Of one program's rows of one case, a gain each, the one that strays least in the task's weights."""
    return min(rows, key=lambda row: row["weighted"])


def main() -> int:
    """Run, print, write; 0 when done, 2 for bad input."""
    options = _options()
    joints = [DEMO] if options.quick else list(ftqp.robots.load("panda").joints)
    versions, left_out = {}, {}
    known = () if options.own else RIVALS
    rivals = [one for one in known if one[1] is None or _there(one, options.env_dir, left_out)]
    cases = goals(1 if options.quick else options.goals)
    programs = ["ftqp", *rivals]
    circles = [(who, joint, told, False) for told in (False, True) for who in programs for joint in joints]
    past = [who for who in programs if who == "ftqp" or who[1] in SEE_THE_BOX]
    boxes = [(who, DEMO, told, True) for told in (False, True) for who in past]
    trips = [(case, who, told) for told in (False, True) for who in programs for case in cases]
    rides = [(one, *case) for who, *case in circles + boxes for one in wired(who)]
    ways = [(case, one, told) for case, who, told in trips for one in wired(who)]
    with ProcessPoolExecutor(options.jobs) as pool:
        found = iter(list(pool.map(ridden, rides, repeat(options.env_dir))))
        arrived = iter(list(pool.map(led, ways, repeat(options.env_dir))))
    rows = []
    for who, *_ in circles + boxes:
        tried = [next(found) for _ in wired(who)]
        rows.append(best([row for row, _ in tried]))
        versions |= tried[0][1]
    circle, box = rows[: len(circles)], rows[len(circles) :]
    arrivals = [best([next(arrived) for _ in wired(who)]) for _, who, _ in trips]
    command_line.say("")
    ends = []
    for k in range(0, len(trips), max(1, len(cases))):
        (_, who, told), done = trips[k], arrivals[k : k + len(cases)]
        reached = sum(one["off"] <= ARRIVED and one["turned"] <= TURNED for one in done)
        name = who if isinstance(who, str) else who[0]
        off, turned = (float(np.median([one[what] for one in done])) for what in ("off", "turned"))
        ends.append(
            {"program": name, "told": told, "reached": reached, "of": len(done), "off": off, "turned": turned}
        )
    settings = {"joints": len(joints), "goals": len(cases), "gains": list(GAINS)}
    result = {
        **circumstances("peers_in_physics", [], settings),
        "circle": circle, "box": box, "goals": ends, "limitations": list(LIMITATIONS),
    }  # fmt: skip
    result["versions"] |= versions
    result["left_out"] |= left_out
    told_and_not = [circle_tables(circle, told) for told in (False, True)]
    tables = [*(one for pair in told_and_not for one in pair), _box_table(box), _goal_table(ends)]
    docs.publish(result, "Peers on the arm of the demo, in physics", tables, options)
    return 0


def _there(rival, env_dir: Path, left_out: dict) -> bool:
    """Whether the environment of a peer is there; notes why not."""
    robot = ftqp.robots.load("panda")
    try:
        with leading((*rival, GAINS[0]), robot, robot.neutral, GOAL_DT, env_dir):
            return True
    except NotInstalled as error:
        left_out[rival[1]] = str(error)
        return False


def _bold(texts, values) -> tuple[str, ...]:
    """The texts of a row, those of its least value bold."""
    least = min(values)
    return tuple(f"**{one}**" if at == least else one for one, at in zip(texts, values, strict=True))


def circle_tables(rows, told: bool) -> list[Table]:
    """Every joint's lock, a column a program: largest and last distance, the same of the attitude, gains."""
    programs = list(dict.fromkeys(row["program"] for row in rows))
    joints = list(dict.fromkeys(row["joint"] for row in rows))
    at = {(row["program"], row["joint"]): row for row in rows if row["told"] == told}
    title = f"The brake of one joint closes, {'reported at once' if told else 'not reported'}"
    tables = []
    for largest, last, unit, what in (
        ("after", "end", "mm", "distance of the tip from its target"),
        ("turned", "turned_end", "mrad", "turn of the tip away from its target"),
    ):
        lines = []
        for joint in joints:
            of = [at[program, joint] for program in programs]
            ends = ["stopped" if one["said"] in STOPPED else f"then {1e3 * one[last]:.2f}" for one in of]
            most = [f"{1e3 * one[largest]:.2f}" for one in of]
            said = [f"{one}, {end}" for one, end in zip(most, ends, strict=True)]
            lines.append((joint.removeprefix("panda_joint"), *_bold(said, [float(one) for one in most])))
        note = f"Largest {what} after the brake has closed, and the last one [{unit}]."
        if largest == "turned":
            fastest = [max(at[program, joint]["speed"] for joint in joints) for program in programs]
            lines.append(("fastest joint", *(f"{100 * one:.0f} %" for one in fastest)))
            note += " The last line is the largest share of its speed limit that any joint truly had."
        tables.append(
            Table(title=f"{title} [{unit}]", headings=("joint", *programs), rows=lines, notes=(note,))
        )
    gains = [
        (joint.removeprefix("panda_joint"), *(f"{at[program, joint]['gain']:g}" for program in programs[1:]))
        for joint in joints
    ]
    tried = ", ".join(f"{gain:g}" for gain in sorted(GAINS))
    note = f"Of {tried} 1/s the one that strays least in that row, distance and turn together."
    tables.append(
        Table(title=f"{title}: gains [1/s]", headings=("joint", *programs[1:]), rows=gains, notes=(note,))
    )
    return tables


def _compared(rows, columns) -> list[tuple[str, ...]]:
    """Lines of a table, reported and not apart: (text of a row, what is least for the best, or None)."""
    lines = []
    for told in (False, True):
        of = [row for row in rows if row["told"] == told]
        cells = [[row["program"] for row in of], ["yes" if told else "no"] * len(of)]
        for text, least in columns:
            texts = [text(row) for row in of]
            cells.append(texts if least is None else _bold(texts, [least(row) for row in of]))
        lines += list(zip(*cells, strict=True))
    return lines


def _in_thousandths(what: str):
    """A column of that entry in mm or mrad, the least being the best."""
    return (lambda row: f"{1e3 * row[what]:.1f}", lambda row: round(1e3 * row[what], 1))


def _box_table(rows) -> Table:
    """The box."""
    columns = [
        (lambda row: f"{1e3 * row['near']:.1f}", lambda row: -round(1e3 * row["near"], 1)),
        (lambda row: f"{row['force']:.0f}", None),
        *(_in_thousandths(what) for what in ("after", "end", "turned", "turned_end")),
    ]
    headings = (
        "program", "reported", "nearest [mm]", "force [N]", "off at most [mm]", "off at the end [mm]",
        "turned at most [mrad]", "turned at the end [mrad]",
    )  # fmt: skip
    note = (
        "The brake of joint 3 closes; a box stands where the elbow then goes, and six joints cannot keep "
        f"the tip's pose and pass it, too. Asked were {1e3 * KEEP:g} mm; the force is the hardest contact. "
        "A peer has the gain that strays least; bold is the best of a column, reported and not."
    )
    return Table(title="A box in the way", headings=headings, rows=_compared(rows, columns), notes=(note,))


def _goal_table(rows) -> Table:
    """The goals."""
    columns = [
        (lambda row: f"{row['reached']} of {row['of']}", lambda row: -row["reached"]),
        *(_in_thousandths(what) for what in ("off", "turned")),
    ]
    note = (
        f"A brake closes {BRAKES_AT:g} s after the start. Six joints reach the goal, but not straight on. "
        f"Reached is within {1e3 * ARRIVED:g} mm and {TURNED:g} rad at the end; the others are medians. At "
        "each goal a peer has the gain that ends nearest; bold is the best of a column, reported and not."
    )
    return Table(
        title="Goals that need another posture",
        headings=("program", "reported", "goals reached", "off at the end [mm]", "turned at the end [mrad]"),
        rows=_compared(rows, columns),
        notes=(note,),
    )


def _options() -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    add("--quick", action="store_true", help="the demo's joint, the box and one goal")
    add("--own", action="store_true", help="ftqp alone, after its code has changed")
    add("--env-dir", type=Path, default=DEFAULT, metavar="DIR", help=f"of the peers (default {DEFAULT})")
    add("--goals", type=int, default=GOALS, metavar="N", help=f"how many (default {GOALS})")
    add("--jobs", type=command_line.at_least_one, default=1, metavar="N", help="processes (default 1)")
    docs.options(parser)
    options: argparse.Namespace = parser.parse_args()
    return options


if __name__ == "__main__":
    sys.exit(main())
