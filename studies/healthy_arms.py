"""Torque arms that work, and of whose rotors, friction or load nobody knows: is a joint named?

Arms in MuJoCo follow a circle at 1 kHz. What they have beside their model is in their truth only; the noise
of their encoders is stated. A finding is a false one. For comparison joints of the same arms fail.

    python studies/healthy_arms.py [--quick] [--out DIR] [--json]     needs pip install -e ".[sim]"

Full study: a minute on one core; ``--seeds 4 --cases 20`` takes ten. Results go to ``studies/results``
unless --out says otherwise.
"""

from typing import Any

import numpy as np
from bench import study
from bench.tables import Table

import ftqp
from ftqp.sim.plants.troubled_plant import Weakened

DT, SECONDS, RADIUS = 0.001, 4.0, 0.1
ARMS = ("panda", "iiwa14")
NOISES = (0.0, 5e-5, 2e-4)
FAULTS = ("locked", "free", "half torque")
SEEDS, CASES = 1, 2


def truths(robot: ftqp.Robot) -> dict[str, dict[str, Any]]:
    """What an arm may have beside its model; wrists have a quarter of the friction."""

    def dry(most: float) -> dict[str, float]:
        return {name: most if i < 4 else 0.25 * most for i, name in enumerate(robot.joints)}

    return {
        "nothing": {},
        "friction 0.5 N m": {"coulomb": dry(0.5)},
        "rotors 0.05, friction 1 N m": {"rotors": 0.05, "coulomb": dry(1.0)},
        "rotors 0.1, friction 3 N m": {"rotors": 0.1, "coulomb": dry(3.0)},
        "rotors 0.3, friction 1 N m": {"rotors": 0.3, "coulomb": dry(1.0)},
        "load 1 kg": {"payload": ftqp.Payload(1.0, (0.0, 0.0, 0.05))},
    }


def fail(plant: ftqp.MujocoPlant, joint: int, kind: str) -> None:
    """Let the joint fail; nobody says so."""
    if kind == "half torque":
        plant.suffer(Weakened(joint, 0.5))
    else:
        plant.fail(ftqp.Locked(joint) if kind == "locked" else ftqp.FreeSwinging(joint))


def run(
    robot: ftqp.Robot, truth: dict[str, Any], noise: float, seed: int, fault: tuple[int, str] | None = None
) -> dict[str, Any]:
    """What was found, how long after the fault, and whether the arm stopped."""
    n, q, rng = robot.nv, robot.neutral, np.random.default_rng(seed)
    plant = ftqp.MujocoPlant(robot, DT, ftqp.JointServo(robot, "torque"), ftqp.TrueArm(**truth))
    plant.reset(q, np.zeros(n))
    planner = ftqp.Planner(robot, DT, drive="torque", noise=ftqp.Noise(q=noise) if noise else None)
    planner.reset(q)
    turned = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    path = ftqp.paths.Circle(robot.pose(q), RADIUS, duration=SECONDS, axes=(turned[0], turned[1]))
    way, target = path.sample(DT * np.arange(round(SECONDS / DT))), ftqp.Target(pose=robot.pose(q))
    at = rng.uniform(1.0, 2.5) if fault else 0.0
    for k in range(len(way.pose)):
        if fault and k == round(at / DT):
            fail(plant, *fault)
        target.at(way.pose[k], way.twist[k], way.acceleration[k])
        step = planner.step(plant.q + noise * rng.standard_normal(n), None, target)
        if planner.findings:
            break
        plant.advance(step)
    found = planner.findings[0] if planner.findings else None
    return {
        "found": None if found is None else found.sentence,
        "joint": None if found is None else robot.joint(found.joint),
        "after": None if found is None else found.detected_at - at,
        "stopped": planner.stopped_because,
    }


def measured(quick: bool, seeds: int, cases: int) -> list[dict[str, Any]]:
    """Arms that work, then arms of which a joint fails."""
    rows = []
    for name in ARMS[: 1 if quick else None]:
        robot = ftqp.robots.load(name)
        robot = robot.with_rotors(0.0)
        for label, truth in list(truths(robot).items())[: 2 if quick else None]:
            for noise in NOISES[: 1 if quick else None]:
                for seed in range(seeds):
                    told = run(robot, truth, noise, seed)
                    rows.append({"arm": name, "truth": label, "noise": noise, "fault": None, **told})
            for kind in FAULTS:
                rng = np.random.default_rng(7)
                for seed in range(cases):
                    joint = int(rng.integers(robot.nv))
                    told = run(robot, truth, 5e-5, seed, (joint, kind))
                    told["right"] = told["joint"] == joint
                    rows.append({"arm": name, "truth": label, "noise": 5e-5, "fault": kind, **told})
    return rows


def tables(found: dict[str, Any]) -> list[Table]:
    """By what is in truth only, and every wrong finding in its words."""
    rows, lines = found["rows"], []
    for label in dict.fromkeys(row["truth"] for row in rows):
        own = [row for row in rows if row["truth"] == label and row["fault"] is None]
        cells = [label, len(own), sum(row["found"] is not None for row in own)]
        cells.append(sum(row["stopped"] is not None for row in own))
        for kind in FAULTS:
            failed = [row for row in rows if row["truth"] == label and row["fault"] == kind]
            after = [row["after"] for row in failed if row["right"]]
            wrong = sum(row["found"] is not None and not row["right"] for row in failed)
            cells.append(
                f"{len(after)} of {len(failed)}, {wrong}, {np.median(after) if after else np.nan:.3f}"
            )
        lines.append(tuple(map(str, cells)))
    wrong = [
        f"{row['arm']}, {row['truth']}, noise {row['noise']:g}, {row['fault'] or 'nothing failed'}: "
        f"{row['found'] or row['stopped']}"
        for row in rows
        if (row["fault"] is None and (row["found"] or row["stopped"]))
        or (row["fault"] is not None and row["found"] and not row["right"])
    ]
    headings = (
        "in truth only", "working arms", "a joint is named", "stopped",
        *(f"{kind}: right, another, median [s]" for kind in FAULTS),
    )  # fmt: skip
    noises = ", ".join(f"{noise:g}" for noise in NOISES)
    title = f"A circle in {SECONDS:g} s, noise {noises} rad; faults at 5e-5 rad, after 1 to 2.5 s"
    return [Table(title=title, headings=headings, rows=lines, notes=wrong)]


if __name__ == "__main__":
    parser = study.options(__doc__, "healthy_arms", "one arm, two truths, no noise")
    parser.add_argument("--seeds", type=int, default=SEEDS, help="circles of each (default %(default)s)")
    parser.add_argument("--cases", type=int, default=CASES, help="faults of each kind (default %(default)s)")
    study.on_record(
        parser.parse_args(), "Torque arms that work",
        lambda given: {"rows": measured(given.quick, given.seeds, given.cases)}, tables,
        ("Calibrated arms, arms behind servos, faults of sensors: not looked at.",),
    )  # fmt: skip
