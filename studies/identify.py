"""What a motion of 20 s tells of rotors, friction, load, gains and offsets that a model lacks.

The true arm is MuJoCo's, behind position servos that know its rotors and not its load; the motion is that of
`ftqp identify --motion`. Positions have a noise of 1e-5 rad, torques one of 0.1 N m.

    python studies/identify.py [--quick] [--out DIR] [--json]     needs pip install -e ".[sim]"

Full study: a minute on one core. Results go to ``studies/results`` unless --out says otherwise.
"""

from typing import Any

import numpy as np
from bench import study
from bench.tables import Table

import ftqp
from ftqp.sim.torque_logs import rehearsed

COUNT = 8
"""True arms a robot."""


def drawn(rng: np.random.Generator, robot: ftqp.Robot) -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    """A true arm, and gains and offsets of its log."""
    names = robot.joints
    weak = robot.limits.tau_max / robot.limits.tau_max.max()
    truth = {
        "rotors": dict(zip(names, rng.uniform(0.02, 0.3, robot.nv).tolist(), strict=True)),
        "coulomb": dict(zip(names, (rng.uniform(0.2, 2.0, robot.nv) * weak).tolist(), strict=True)),
        "viscous": dict(zip(names, (rng.uniform(0.2, 2.0, robot.nv) * weak).tolist(), strict=True)),
        "payload": ftqp.Payload(float(rng.uniform(0.3, 2.5)), rng.uniform(-0.08, 0.08, 3)),
    }
    return truth, rng.uniform(-0.1, 0.1, robot.nv), rng.uniform(-0.01, 0.01, robot.nv)


def measured(quick: bool) -> list[dict[str, Any]]:
    """Every arm with drawn truths: the errors of what is found."""
    rows = []
    for name in ("panda", "iiwa14", "xarm7")[: 1 if quick else None]:
        robot = ftqp.robots.load(name)
        robot = robot.with_rotors(0.0) if name == "xarm7" else robot
        motion, rng = ftqp.exciting_motion(robot), np.random.default_rng(7)
        for number in range(2 if quick else COUNT):
            truth, gains, offsets = drawn(rng, robot)
            log = rehearsed(
                robot, motion, ftqp.TrueArm(**truth), position_noise=1e-5, torque_noise=0.1, seed=number
            )
            log = ftqp.TorqueLog(t=log.t, q=log.q - offsets, tau=log.tau * (1.0 + gains), late=log.late)
            found = ftqp.fitted_arm(robot, log)
            row: dict[str, Any] = {"arm": name, "share_left": float((found.left / found.before).max())}
            for kind in ("rotors", "coulomb", "viscous"):
                true = np.array([truth[kind][joint] for joint in robot.joints])
                shown = ~found.not_shown[kind]
                row[kind] = (np.abs(getattr(found, kind) / true - 1.0)[shown]).tolist()
                row[f"{kind}_z"] = ((getattr(found, kind) - true) / found.errors[kind])[shown].tolist()
            shown = ~found.not_shown["gains"]
            row["gains"] = np.abs(found.gains - gains)[shown].tolist()
            shown = ~found.not_shown["offsets"]
            row["offsets"] = np.abs(found.offsets - offsets)[shown].tolist()
            load = truth["payload"]
            row["load"] = abs(found.load[0] / load.mass - 1.0)
            row["centre"] = float(np.linalg.norm(found.load[1:4] / found.load[0] - load.com))
            rows.append(row)
    return rows


COLUMNS = {
    "rotors": ("rotor [%]", 100.0),
    "coulomb": ("dry friction [%]", 100.0),
    "viscous": ("viscous friction [%]", 100.0),
    "gains": ("gain [%]", 100.0),
    "offsets": ("offset [mrad]", 1e3),
    "load": ("load [%]", 100.0),
    "centre": ("its centre [mm]", 1e3),
}
"""Errors, what they are called, and by what they are multiplied."""


def tables(found: dict[str, Any]) -> list[Table]:
    """Errors of what is identified, and how honest its standard errors are."""
    rows, lines = found["rows"], []
    for name in dict.fromkeys(row["arm"] for row in rows):
        own = [row for row in rows if row["arm"] == name]
        cells, missing = [], 0
        for kind, (_, scale) in COLUMNS.items():
            values = scale * np.concatenate([np.atleast_1d(row[kind]) for row in own])
            cells.append(f"{np.median(values):.1f}, {np.quantile(values, 0.9):.1f}")
            if kind not in ("load", "centre"):
                missing += len(own) * ftqp.robots.load(name).nv - len(values)
        lines.append((name, *cells, f"{missing} of {5 * len(own) * ftqp.robots.load(name).nv}"))
    z = np.concatenate([row[f"{kind}_z"] for row in rows for kind in ("rotors", "coulomb", "viscous")])
    notes = (
        "Every value is drawn: rotors 0.02 to 0.3 kg m², friction, a load of 0.3 to 2.5 kg, torques that are "
        "logged up to 10 % wrong, encoders up to 10 mrad off.",
        f"Of rotors and friction {100.0 * np.mean(np.abs(z) < 2.0):.0f} % are within two standard errors of "
        f"the truth and {100.0 * np.mean(np.abs(z) < 3.0):.0f} % within three. At most "
        f"{100.0 * max(row['share_left'] for row in rows):.0f} % of what the model misses of a joint's "
        "torque is left.",
        "Not identified are mostly offsets of joints whose position no torque depends on, the first joint of "
        "an arm that stands upright among them.",
    )
    headings = ("arm", *(label for label, _ in COLUMNS.values()), "not identified")
    title = "Errors of what is identified, median and nine tenths over joints and arms"
    return [Table(title=title, headings=headings, rows=lines, notes=notes)]


if __name__ == "__main__":
    study.on_record(
        study.options(__doc__, "identify", "one arm and two truths").parse_args(),
        "What a motion tells of an arm", lambda given: {"rows": measured(given.quick)}, tables, (),
    )  # fmt: skip
