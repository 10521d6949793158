"""Joints that lose motor and brake on the way, reported at once, on arms of undescribed friction.

Ten arms that are not in the catalog go round a circle in MuJoCo, behind position servos of 15 Hz, velocity
servos, or torque drives; after ``AT`` one joint has nothing but its dry friction, and this is reported
to who leads the arm. Beside ftqp goes the damped least squares of ``ftqp.sim.rival``, which leaves the joint
out; where the arm takes torques, a computed-torque law of 15 Hz goes between, that of the position servo. An
episode is finished where no stop was latched, the tip ends within 10 mm and 0.1 rad of its target, and no
healthy joint was more than 2 % beyond its speed limit. With --healthy nothing fails, as friction that nobody
knows of and circles near singular postures stop arms, too.

    python studies/reported_free_joints.py [--quick] [--healthy] [--jobs N] [--out DIR] [--json]
                                                                     needs pip install -e ".[sim,robots]"

Full study: an hour on one core. Results go to ``studies/results`` unless --out says otherwise.
"""

import logging
import re
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from bench import study
from bench.tables import Table

import ftqp
from ftqp.core.pose import rotation_vector
from ftqp.sim.rival import ResolvedRates

DT, SECONDS, AT, RADIUS = 0.001, 4.0, 1.5, 0.08
FRICTIONS = {"none": 0.0, "1 %": 0.01, "5 %": 0.05}
"""Dry friction of every joint, as a share of its torque limit."""
CATALOG = ("panda", "iiwa14", "xarm7")
FILES = {
    "baxter": ("baxter_description/urdf/baxter.urdf", "left_gripper"),
    "centauro": ("centauro_description/urdf/centauro.urdf", "arm1_8"),
    "kinova": ("kinova_description/robots/kinova.urdf", "j2s6s200_end_effector"),
    "talos": ("talos_data/robots/talos_left_arm.urdf", "gripper_left_base_link"),
    "tiago": ("tiago_description/robots/tiago.urdf", "arm_7_link"),
    "ur3": ("ur_description/urdf/ur3_robot.urdf", "tool0"),
    "ur5": ("ur_description/urdf/ur5_robot.urdf", "tool0"),
    "ur10": ("ur_description/urdf/ur10_robot.urdf", "tool0"),
    "z1": ("z1_description/urdf/z1.urdf", "link06"),
}
"""Files of the package example-robot-data, and their tips."""
HELD = {"tiago": ("torso_lift_joint",)}
STRANGE = (*FILES, "gen3")
ARMS = (*STRANGE, *CATALOG)
DRIVES = ("position", "velocity", "torque")
NEAR, TURNED, FAST = 0.01, 0.1, 1.02
"""How near to its target a tip has to end [m] and [rad], and the share of a speed limit that is kept."""
CONTROLLERS = ("ftqp", "least squares")


def gen3() -> ftqp.Robot:
    """A seven-joint arm with the lengths, masses and limits of a Kinova Gen3, its links as rods."""
    lengths = (0.2848, 0.2104, 0.2104, 0.2084, 0.1059, 0.1059, 0.0615)
    masses = (1.38, 1.16, 1.16, 0.93, 0.68, 0.68, 0.36)
    said, at = ['<link name="l0"/>'], 0.0
    for i, (length, mass) in enumerate(zip(lengths, masses, strict=True), start=1):
        thin, long = mass * 0.04**2, mass * (0.04**2 + length**2 / 12.0)
        axis, most = ("0 1 0", 2.3) if i % 2 == 0 else ("0 0 1", 6.0)
        speed, effort = (1.39, 54) if i < 5 else (1.22, 34)
        said.append(
            f'<link name="l{i}"><inertial><origin xyz="0 0 {length / 2}"/><mass value="{mass}"/>'
            f'<inertia ixx="{long}" iyy="{long}" izz="{thin}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="j{i}" type="revolute"><parent link="l{i - 1}"/><child link="l{i}"/>'
            f'<origin xyz="0 0 {at}"/><axis xyz="{axis}"/>'
            f'<limit lower="{-most}" upper="{most}" velocity="{speed}" effort="{effort}"/></joint>'
        )
        at = length
    said.append(
        '<link name="tip"/><joint name="end" type="fixed"><parent link="l7"/><child link="tip"/>'
        '<origin xyz="0 0 0.12"/></joint>'
    )
    return _read("gen3", f'<robot name="gen3">{"".join(said)}</robot>', "tip")


def _read(name: str, text: str, tip: str, held: tuple[str, ...] = ()) -> ftqp.Robot:
    """A robot of that URDF, without its shapes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.urdf"
        path.write_text(re.sub(r"<(visual|collision)\b[^>]*>.*?</\1>", "", text, flags=re.DOTALL))
        return ftqp.Robot.from_urdf(path, tip=tip, locked=held)


@cache
def arm(name: str) -> ftqp.Robot:
    """The arm of that name."""
    if name in CATALOG:
        return ftqp.robots.load(name)
    if name == "gen3":
        return gen3()
    rods = find_spec("pinocchio")
    assert rods is not None and rods.origin is not None
    file, tip = FILES[name]
    share = Path(rods.origin).parents[4] / "share/example-robot-data/robots"
    return _read(name, (share / file).read_text(), tip, HELD.get(name, ()))


def start(robot: ftqp.Robot, rng: np.random.Generator) -> Any:
    """A posture well inside the ranges and far from singular."""
    low, high = robot.limits.q_min, robot.limits.q_max
    while True:
        q = np.clip(robot.neutral + rng.uniform(-0.6, 0.6, robot.nv), low + 0.3, high - 0.3)
        if np.linalg.svd(_scaled(robot, q), compute_uv=False)[-1] > 0.1:
            return q


def _scaled(robot: ftqp.Robot, q: Any) -> Any:
    J = robot.jacobian(q).copy()
    J[:3] /= robot.length
    return J


def ridden(
    plant: ftqp.MujocoPlant, planner: ftqp.Planner, way: Any, q: Any, controller: str, at: int,
    fail: Callable[[ResolvedRates], None],
) -> Iterator[tuple[int, Any]]:  # fmt: skip
    """Each tick of an arm that one of the two leads, and what was sent; ``fail`` is called at a tick."""
    rates, target = ResolvedRates(planner.robot, planner.dt, rows=planner.task_rows), ftqp.Target(way.pose[0])
    planner.reset(q)
    rates.reset(q)
    for k in range(len(way.pose)):
        if k == at:
            fail(rates)
        target.at(way.pose[k], way.twist[k], way.acceleration[k])
        own = controller == "ftqp"
        sent: Any = (
            planner.step(plant.q, None, target) if own else rates.step(plant.q, way.pose[k], way.twist[k])
        )
        plant.advance(sent)
        yield k, sent.reference if own else sent


def episode(
    name: str, drive: str, joint: int, label: str, seed: int, controller: str, fails: bool
) -> dict[str, Any]:
    """How one arm ends whose joint fails, or, to compare, none does."""
    robot, share = arm(name), FRICTIONS[label]
    rng = np.random.default_rng(100 * joint + seed)
    q, limits, n = start(robot, rng), robot.limits, robot.nv
    mass = np.diag(robot.mass_matrix(q))
    most = np.minimum(np.where(np.isfinite(limits.tau_max), limits.tau_max, 100.0), 200.0 * mass / mass.max())
    dry = dict(zip(robot.joints, share * most, strict=True))
    takes = "position" if controller != "ftqp" and drive == "torque" else drive
    plant = ftqp.MujocoPlant(robot, DT, ftqp.JointServo(robot, takes), ftqp.TrueArm(coulomb=dry), substeps=2)
    plant.reset(q, np.zeros(n))
    turned = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    path = ftqp.paths.Circle(robot.pose(q), RADIUS, duration=SECONDS, axes=(turned[0], turned[1]))
    way = path.sample(DT * np.arange(round(SECONDS / DT) + 1))
    rows = "pose" if n > 6 else "position"
    planner = ftqp.Planner(robot, DT, task=ftqp.Task(rows=rows), drive=drive)
    healthy, fast, far, before = np.arange(n) != joint, 0.0, 0.0, q

    def fail(rates: ResolvedRates) -> None:
        nonlocal before
        before = plant.q.copy()
        if fails:
            plant.fail(ftqp.FreeSwinging(joint))
            planner.report(ftqp.FreeSwinging(joint))
            rates.tell(joint)

    for k, _ in ridden(plant, planner, way, q, controller, round(AT / DT), fail):
        fast = max(fast, float((np.abs(plant.v) / limits.v_max)[healthy].max()))
        if k % 20 == 0:
            far = max(far, float(np.linalg.norm(robot.pose(plant.q)[:3, 3] - way.pose[k][:3, 3])))
    end = robot.pose(plant.q)
    off = float(np.linalg.norm(end[:3, 3] - way.pose[-1][:3, 3]))
    turn = float(np.linalg.norm(rotation_vector(end[:3, :3] @ way.pose[-1][:3, :3].T)))
    stopped = planner.stopped_because if controller == "ftqp" else None
    kept = off < NEAR and (rows == "position" or turn < TURNED)
    return {
        "arm": name,
        "drive": drive,
        "joint": joint + 1,
        "friction": label,
        "seed": seed,
        "controller": controller,
        "finished": bool(kept and fast <= FAST and stopped is None),
        "far": far,
        "end": off,
        "turned": turn,
        "fast": fast,
        "swung": float(abs(plant.q[joint] - before[joint])),
        "stopped": stopped,
    }


def episodes(names: list[str], drives: list[str], seeds: int, fails: bool) -> Iterator[tuple[Any, ...]]:
    """Every arm, drive, joint, friction and controller."""
    for name in names:
        for drive in drives:
            for joint in range(arm(name).nv):
                for label in FRICTIONS:
                    for seed in range(seeds):
                        yield from ((name, drive, joint, label, seed, who, fails) for who in CONTROLLERS)


def _of(case: tuple[Any, ...]) -> dict[str, Any]:
    logging.getLogger("ftqp").setLevel(logging.ERROR)
    return episode(*case)


def _cell(rows: list[dict[str, Any]], most: bool) -> str:
    """finished, median and largest distance, broken limits."""
    far = [1e3 * row["far"] for row in rows]
    fast = sum(row["fast"] > FAST for row in rows)
    text = f"{sum(row['finished'] for row in rows)} of {len(rows)}"
    if most:
        text = f"**{text}**"
    return f"{text} | {np.median(far):.0f}, {max(far):.0f} | {fast}"


def tables(found: dict[str, Any]) -> list[Table]:
    """By arm and drive, then by drive and friction; bold is who finishes more."""
    rows, drives = found["rows"], list(dict.fromkeys(row["drive"] for row in found["rows"]))
    names = dict.fromkeys(row["arm"] for row in rows)
    keys = [(name, drive, "all") for name in names for drive in drives]
    keys += [("all", drive, label) for drive in drives for label in FRICTIONS]
    headings = (
        "arm", "drive", "friction",
        *(f"{name}: {what}" for name in CONTROLLERS
          for what in ("finished", "farthest [mm] p50, max", "too fast")),
    )  # fmt: skip
    notes = (
        f"Circles of {RADIUS:g} m in {SECONDS:g} s; the joint fails after {AT:g} s. Friction is dry, a share "
        "of the torque limit, unknown to both. Beside a torque drive damped least squares lead a "
        "computed-torque law of 15 Hz, that of the position servo.",
        f"{len(rows) // len(CONTROLLERS)} episodes, each by both. Finished: no stop, the tip within "
        f"{1e3 * NEAR:g} mm and {TURNED:g} rad of its target in the end, no healthy joint above {FAST:g} "
        "times its limit. Arms of six joints are asked for a position only. Torque limits are the files'.",
    )
    lines = [_line(rows, *key) for key in keys]
    return [Table(title="Who finishes", headings=headings, rows=lines, notes=notes)]


def _line(rows: list[dict[str, Any]], name: str, drive: str, label: str) -> tuple[str, ...]:
    """A row of the table; "all" takes every arm or friction."""
    own = [
        row
        for row in rows
        if name in ("all", row["arm"]) and row["drive"] == drive and label in ("all", row["friction"])
    ]
    sides = [[row for row in own if row["controller"] == who] for who in CONTROLLERS]
    done = [sum(row["finished"] for row in side) for side in sides]
    cells = [_cell(side, k == max(done) != min(done)) for side, k in zip(sides, done, strict=True)]
    return name, drive, label, *(cell for of in cells for cell in of.split(" | "))


def _ridden(given: Any) -> dict[str, Any]:
    names, drives = (["xarm7"], ["position"]) if given.quick else (given.arms, given.drives)
    with ProcessPoolExecutor(given.jobs) as pool:
        return {"rows": list(pool.map(_of, episodes(names, drives, given.seeds, not given.healthy)))}


if __name__ == "__main__":
    parser = study.options(__doc__, "reported_free_joints", "xarm7 behind position servos alone")
    add = parser.add_argument
    add("--arms", nargs="+", choices=ARMS, default=list(STRANGE), help="which (default ten)")
    add("--drives", nargs="+", choices=DRIVES, default=list(DRIVES), help="which")
    add("--jobs", type=int, default=1, help="processes (default %(default)s)")
    add("--healthy", action="store_true", help="nothing fails")
    add("--seeds", type=int, default=1, help="circles of each (default %(default)s)")
    study.on_record(
        parser.parse_args(), "Joints without motor and brake, reported at once", _ridden, tables,
        ("Noise, loads, arms at other speeds: not looked at.",),
    )  # fmt: skip
