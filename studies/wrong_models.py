"""Torque arms whose models lack rotors, a load or friction: four laws hold them to the same circle.

The arm is MuJoCo's, at 1 kHz; rotors, load, friction and noise are in its truth only. The laws: joint PD,
400 N m/rad and 40 N m s/rad, with the model's feed-forward, on the planner's own command and true velocities;
the planner with the model as it is (``inertia_error=0``); the planner as it comes, which learns; the planner
that is told the truth.

    python studies/wrong_models.py [--quick] [--out DIR] [--json]     needs pip install -e ".[sim]"

Full study: two minutes on one core. Results go to ``studies/results`` unless --out says otherwise.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
from bench import study
from bench.tables import Table

import ftqp

DT, SECONDS, RADIUS = 0.001, 5.0, 0.1
LAWS = ("PD 400/40", "as it is", "estimates", "true model")
FAR = 0.05
"""An arm is lost when it stops, or when its tip is farther from its way than this [m]."""


def load(mass: float) -> ftqp.Payload:
    """A load 5 cm in front of the tip."""
    return ftqp.Payload(mass, (0.0, 0.0, 0.05))


CASES: list[tuple[str, dict[str, Any]]] = [
    ("nothing", {}),
    ("rotors 0.05", {"rotors": 0.05}),
    ("rotors 0.1", {"rotors": 0.1}),
    ("rotors 0.3", {"rotors": 0.3}),
    ("load 1 kg", {"payload": load(1.0)}),
    ("load 3 kg", {"payload": load(3.0)}),
    ("rotors 0.1, load 1 kg", {"rotors": 0.1, "payload": load(1.0)}),
    ("rotors 0.1, friction 0.3 N m", {"rotors": 0.1, "coulomb": 0.3}),
    ("rotors 0.1, load 1 kg, friction 0.3 N m, noise 2e-5", {
        "rotors": 0.1, "payload": load(1.0), "coulomb": 0.3, "noise": 2e-5}),
]  # fmt: skip


def run(robot: ftqp.Robot, law: str, noise: float = 0.0, **truth: Any) -> tuple[float, bool]:
    """The largest error of the true tip [m], and whether the arm was lost."""
    n, q = robot.nv, robot.neutral
    model = robot
    if law == "true model":
        model = robot.with_rotors(robot.chain.armature + truth.get("rotors", 0.0))
        model = model.with_payload(truth["payload"]) if "payload" in truth else model
    plant = ftqp.MujocoPlant(robot, DT, ftqp.JointServo(robot, "torque"), ftqp.TrueArm(**truth))
    plant.reset(q, np.zeros(n))
    error = None if law == "estimates" else 0.0
    pd = law.startswith("PD")
    drive = ftqp.Drive() if pd else ftqp.Drive(kind="torque", inertia_error=error)
    planner = ftqp.Planner(model, DT, drive=drive, noise=ftqp.Noise(q=noise))
    planner.reset(q)
    start = robot.pose(q)
    path = ftqp.paths.Circle(start, RADIUS, duration=SECONDS, axes=((0, 1, 0), (0, 0, 1)))
    way = path.sample(DT * np.arange(round(SECONDS / DT)))
    target, rng, far, lost = ftqp.Target(pose=start), np.random.default_rng(1), 0.0, False
    none, at = np.zeros(n, dtype=bool), q.copy()
    for k in range(round(SECONDS / DT)):
        target.at(way.pose[k], way.twist[k], way.acceleration[k])
        seen = plant.q + rng.normal(0.0, noise, n) if noise else plant.q.copy()
        if pd:
            step = planner.step(at, None, target)
            at = step.q.copy()
            pull = 400.0 * (step.q - seen) + 40.0 * (step.v - plant.v)
            tau = robot.mass_matrix(step.q) @ step.a + robot.bias(step.q, step.v) + pull
            tau = np.clip(tau, -robot.limits.tau_max, robot.limits.tau_max)
            plant.advance(SimpleNamespace(q=step.q, v=step.v, tau=tau, brakes=none))
        else:
            step = planner.step(seen, None, target)
            plant.advance(step)
        ahead = way.pose[min(k + 1, len(way.pose) - 1), :3, 3]
        off = float(np.linalg.norm(robot.pose(plant.q)[:3, 3] - ahead))
        far = max(far, off)
        if step.status.name in ("STOPPING", "STOPPED") or off > FAR or not np.isfinite(off):
            lost = True
            break
    return far, lost


def measured(quick: bool) -> list[dict[str, Any]]:
    """Every arm, truth and law."""
    arms = [ftqp.robots.load("panda"), ftqp.robots.load("iiwa14"), ftqp.robots.load("xarm7").with_rotors(0.0)]
    rows = []
    for robot in arms[: 1 if quick else None]:
        for label, truth in CASES[: 3 if quick else None]:
            row: dict[str, Any] = {"arm": robot.name, "truth": label}
            for law in LAWS:
                far, lost = run(robot, law, **truth)
                row[law] = None if lost else 1e3 * far
            rows.append(row)
    return rows


def tables(found: dict[str, Any]) -> list[Table]:
    """The largest errors."""
    told = [
        (row["arm"], row["truth"], *("lost" if row[law] is None else f"{row[law]:.2f}" for law in LAWS))
        for row in found["rows"]
    ]
    title = f"The largest error of the tip [mm] on a circle of {RADIUS} m in {SECONDS:g} s"
    return [Table(title=title, headings=("arm", "in truth only", *LAWS), rows=told)]


if __name__ == "__main__":
    study.on_record(
        study.options(__doc__, "wrong_models", "one arm and three truths").parse_args(),
        "Torque arms whose models lack something", lambda given: {"rows": measured(given.quick)}, tables,
        ("One posture of each arm and one way, exact samples but for the last row, none of them late, rotors "
         "that are the same in all joints, no joint that fails.",),
    )  # fmt: skip
