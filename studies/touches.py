"""Something pushes the tip of a healthy arm, or one of its motors fails: is the one taken for the other?

Arms in MuJoCo follow a circle, 1 kHz, encoder noise 1e-5 rad, and nothing of their drives is stated.
Something pushes the tip for 0.1 to 0.6 s, up to 10 to 80 N in a random direction; or, for comparison, a joint
locks, swings freely or keeps half of its torque, and nobody says so.

    python studies/touches.py [--quick] [--out DIR] [--json]     needs pip install -e ".[sim]"

Full study: a minute on one core. Results go to ``studies/results`` unless --out says otherwise.
"""

from typing import Any

import numpy as np
from bench import study
from bench.tables import Table

import ftqp
from ftqp.sim.plants.troubled_plant import Weakened

DT, SECONDS, RADIUS, NOISE = 0.001, 2.5, 0.1, 1e-5
CASES = 20
"""Pushes of an arm and drive, and as many faults."""
FAULTS = ("locked", "free", "half torque")


def drawn(rng: np.random.Generator, robot: ftqp.Robot, fault: bool) -> dict[str, Any]:
    """When what happens."""
    case: dict[str, Any] = {"at": float(rng.uniform(0.5, 1.5))}
    if fault:
        joint = int(rng.integers(robot.nv))
        kind = FAULTS[int(rng.integers(len(FAULTS)))]
        case |= {"joint": joint, "fault": kind}
    else:
        way = rng.standard_normal(3)
        case |= {"force": rng.uniform(10.0, 80.0) * way / np.linalg.norm(way), "for": rng.uniform(0.1, 0.6)}
    return case


def run(robot: ftqp.Robot, drive: str, case: dict[str, Any], seed: int) -> dict[str, Any]:
    """What the planner said of it."""
    n, rng = robot.nv, np.random.default_rng(seed)
    planner = ftqp.Planner(robot, DT, drive=drive, noise=ftqp.Noise(q=NOISE))
    plant = ftqp.MujocoPlant(robot, DT, ftqp.JointServo(robot, drive))
    plant.reset(robot.neutral, np.zeros(n))
    planner.reset(robot.neutral)
    start = robot.pose(robot.neutral)
    path = ftqp.paths.Circle(start, RADIUS, duration=5.0, axes=((0, 1, 0), (0, 0, 1)))
    way = path.sample(DT * np.arange(round(SECONDS / DT)))
    target = ftqp.Target(pose=start)
    told: dict[str, Any] = {"touch": None, "force": None, "stopped": None}
    for k in range(round(SECONDS / DT)):
        t = k * DT
        if k == round(case["at"] / DT) and "fault" in case:
            begin(plant, case)
        if "for" in case:
            since = (t - case["at"]) / case["for"]
            plant.push(case["force"] * (np.sin(np.pi * since) ** 2 if 0.0 <= since <= 1.0 else 0.0))
        target.at(way.pose[k], way.twist[k], way.acceleration[k])
        step = planner.step(plant.q + NOISE * rng.standard_normal(n), None, target)
        if planner.touch is not None or (planner.diagnosis is not None and planner.diagnosis.touched):
            told["touch"] = t - case["at"] if told["touch"] is None else told["touch"]
            if planner.touch is not None and "for" in case and t - case["at"] < case["for"]:
                largest = told["force"] is None or np.linalg.norm(told["force"]) < np.linalg.norm(
                    planner.touch
                )
                told["force"] = planner.touch.tolist() if largest else told["force"]
        plant.advance(step)
    told["found"] = [(robot.joint(one.joint), sorted(one.kinds)) for one in planner.findings]
    told["stopped"] = planner.stopped_because
    return told


def begin(plant: ftqp.MujocoPlant, case: dict[str, Any]) -> None:
    """Let the joint fail."""
    joint = case["joint"]
    if case["fault"] == "locked":
        plant.fail(ftqp.Locked(joint))
    elif case["fault"] == "free":
        plant.fail(ftqp.FreeSwinging(joint))
    else:
        plant.suffer(Weakened(joint, 0.5))


def measured(quick: bool) -> list[dict[str, Any]]:
    """Every arm and drive: pushes and faults."""
    rows = []
    for name in ("panda", "iiwa14")[: 1 if quick else None]:
        robot = ftqp.robots.load(name)
        for drive in ("torque", "position")[: 1 if quick else None]:
            for fault in (False, True):
                rng = np.random.default_rng(11)
                for number in range(4 if quick else CASES):
                    case = drawn(rng, robot, fault)
                    told = run(robot, drive, case, number)
                    row = {"arm": name, "drive": drive, "fault": fault, **told}
                    row["right"] = [joint for joint, _ in told["found"]] == [case.get("joint")]
                    if not fault and told["force"] is not None:
                        row["off"] = float(np.linalg.norm(np.array(told["force"]) - case["force"]))
                        row["size"] = float(np.linalg.norm(case["force"]))
                    rows.append(row)
    return rows


def tables(found: dict[str, Any]) -> list[Table]:
    """By arm and drive."""
    rows, lines = found["rows"], []
    for key in dict.fromkeys((row["arm"], row["drive"]) for row in rows):
        own = [row for row in rows if (row["arm"], row["drive"]) == key]
        pushes, faults = ([row for row in own if row["fault"] == fault] for fault in (False, True))
        off = [row["off"] / row["size"] for row in pushes if "off" in row]
        cells = (
            *key, len(pushes), sum(row["touch"] is not None for row in pushes),
            sum(bool(row["found"]) for row in pushes), sum(row["stopped"] is not None for row in pushes),
            f"{100.0 * float(np.median(off)):.0f} %" if off else "", len(faults),
            sum(row["touch"] is not None for row in faults), sum(row["right"] for row in faults),
            sum(bool(row["found"]) and not row["right"] for row in faults),
        )  # fmt: skip
        lines.append(tuple(map(str, cells)))
    headings = (
        "arm", "drive", "pushes", "said to be a push", "a joint is named", "arm stopped",
        "force off by", "faults", "said to be a push", "right joint named", "another",
    )  # fmt: skip
    return [Table(title="Something pushes the tip, or a motor fails", headings=headings, rows=lines)]


if __name__ == "__main__":
    study.on_record(
        study.options(__doc__, "touches", "one arm and drive, four cases each").parse_args(),
        "Pushed, or failed?", lambda given: {"rows": measured(given.quick)}, tables,
        ("Pushes of other links, contacts that stay, calibrated arms: not looked at.",),
    )  # fmt: skip
