"""Joints that lose torque on the way, reported at once: are they led to where they cannot hold the arm?

Arms go round a circle in MuJoCo, behind position servos of 15 Hz, velocity servos, or torque drives. After
``AT`` one joint has so much of its torque left that it holds the arm's weight where it is, with some room,
and who leads the arm is told. Beside ftqp goes the damped least squares of ``ftqp.sim.rival``, which knows no
torques; where the arm takes torques, a computed-torque law of 15 Hz goes between. Joints on which gravity
hardly acts are left out. An episode is finished where no stop was latched, the tip ends within 10 mm of its
target, and no joint was more than 2 % beyond its speed limit. A joint fell where it was ``FELL`` from where
it was sent.

    python studies/weak_joints.py [--quick] [--rooms R ...] [--jobs N] [--out DIR] [--json]
                                                                     needs pip install -e ".[sim,robots]"

Full study: a quarter of an hour on one core. Results go to ``studies/results`` unless --out says otherwise.
"""

import argparse
import logging
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import pinocchio as pin
from bench import study
from bench.tables import Table
from reported_free_joints import ARMS, CONTROLLERS, DRIVES, FAST, NEAR, arm, ridden, start

import ftqp
from ftqp.sim.rival import ResolvedRates

DT, SECONDS, REST, AT, RADIUS = 0.002, 5.0, 1.0, 1.0, 0.1
SHOWN = ("panda", "gen3", "kinova", "talos", "ur5", "z1")
ROOMS = (1.05, 1.3)
"""The torque that is left, as a multiple of what holds the arm where it is then."""
LEAST = 0.02
"""Joints that gravity loads with a smaller share of the arm's largest torque limit are left out."""
FELL = 0.05
LIMITATION = (
    "Noise, loads, models that are wrong: not looked at. talos and z1 have dry friction, which neither "
    "counts in: a weak joint that needs its torque for friction does not follow, and ftqp stops for that."
)


def weight(robot: ftqp.Robot, q: Any) -> Any:
    """The torques that hold the arm still."""
    return pin.computeGeneralizedGravity(robot.model, robot.model.createData(), robot.configuration(q))


def episode(
    name: str, drive: str, joint: int, room: float, seed: int, controller: str
) -> dict[str, Any] | None:
    """How one arm ends; None where gravity hardly acts on the joint."""
    robot = arm(name)
    rng = np.random.default_rng(100 * joint + seed)
    q, limits, n = start(robot, rng), robot.limits, robot.nv
    takes = "position" if controller != "ftqp" and drive == "torque" else drive
    plant = ftqp.MujocoPlant(robot, DT, ftqp.JointServo(robot, takes), ftqp.TrueArm(), substeps=2)
    plant.reset(q, np.zeros(n))
    turned = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    path = ftqp.paths.Circle(robot.pose(q), RADIUS, duration=SECONDS, axes=(turned[0], turned[1]))
    way = path.sample(DT * np.arange(round((SECONDS + REST) / DT)))
    planner = ftqp.Planner(robot, DT, task=ftqp.Task(rows="position"), drive=drive)
    told, fast, dropped, left, far, least = round(AT / DT), 0.0, 0.0, 0.0, 0.0, np.inf

    def weaken(_: ResolvedRates) -> None:
        nonlocal left
        left = min(room * abs(weight(robot, plant.q)[joint]), limits.tau_max[joint])
        fault = ftqp.Degraded(joint, torque=left / limits.tau_max[joint])
        plant.fail(fault)
        planner.report(fault)

    for k, sent in ridden(plant, planner, way, q, controller, told, weaken):
        if k == told - 1 and abs(weight(robot, plant.q)[joint]) < LEAST * limits.tau_max.max():
            return None
        fast = max(fast, float((np.abs(plant.v) / limits.v_max).max()))
        if k >= told:
            dropped = max(dropped, float(abs(sent.q[joint] - plant.q[joint])))
            if k % 10 == 0:
                least = min(least, float(1.0 - abs(weight(robot, plant.q)[joint]) / left))
                far = max(far, float(np.linalg.norm(robot.pose(plant.q)[:3, 3] - way.pose[k][:3, 3])))
    off = float(np.linalg.norm(robot.pose(plant.q)[:3, 3] - way.pose[-1][:3, 3]))
    stopped = planner.stopped_because if controller == "ftqp" else None
    return {
        "arm": name,
        "drive": drive,
        "joint": joint + 1,
        "room": room,
        "seed": seed,
        "controller": controller,
        "finished": bool(off < NEAR and fast <= FAST and stopped is None),
        "fell": bool(dropped > FELL),
        "share": left / float(limits.tau_max[joint]),
        "least": least,
        "end": off,
        "far": far,
        "dropped": dropped,
        "fast": fast,
        "stopped": stopped,
    }


def episodes(given: argparse.Namespace) -> Iterator[tuple[Any, ...]]:
    """Every arm, drive, joint, room and controller."""
    for name in given.arms:
        for drive in given.drives:
            for joint in range(arm(name).nv):
                for room in given.rooms:
                    for seed in range(given.seeds):
                        yield from ((name, drive, joint, room, seed, who) for who in CONTROLLERS)


def _of(case: tuple[Any, ...]) -> dict[str, Any] | None:
    logging.getLogger("ftqp").setLevel(logging.ERROR)
    return episode(*case)


def _cells(rows: list[dict[str, Any]]) -> tuple[str, ...]:
    """finished, fell, and how far the tip ends from its target."""
    end = [1e3 * row["end"] for row in rows]
    return (
        f"{sum(row['finished'] for row in rows)} of {len(rows)}",
        f"{sum(row['fell'] for row in rows)}",
        f"{np.median(end):.1f}, {max(end):.0f}",
    )


def tables(found: dict[str, Any]) -> list[Table]:
    """By arm, then by drive and room."""
    rows = found["rows"]
    groups = [
        (key, value) for key in ("arm", "drive", "room") for value in dict.fromkeys(r[key] for r in rows)
    ]
    lines = []
    for key, value in groups:
        own = [row for row in rows if row[key] == value]
        sides = [[row for row in own if row["controller"] == who] for who in CONTROLLERS]
        lines.append((key, str(value), *(cell for side in sides for cell in _cells(side))))
    headings = (
        "", "", *(f"{name}: {what}" for name in CONTROLLERS
                  for what in ("finished", "fell", "tip ends off [mm] p50, max")),
    )  # fmt: skip
    notes = (
        f"Circles of {RADIUS:g} m in {SECONDS:g} s; after {AT:g} s a joint has what holds the arm there, "
        "times the room. The tip is asked for a position. Finished: no stop, the tip within "
        f"{1e3 * NEAR:g} mm of its target after {REST:g} s more, no joint above {FAST:g} times its speed "
        f"limit. Fell: the joint was {FELL:g} rad or more from where it was sent.",
        f"{len(rows) // len(CONTROLLERS)} episodes, each by both.",
    )
    return [Table(title="Who finishes", headings=headings, rows=lines, notes=notes)]


def _ridden(given: argparse.Namespace) -> dict[str, Any]:
    if given.quick:
        given.arms, given.drives, given.rooms = ["panda"], ["position"], [1.15]
    with ProcessPoolExecutor(given.jobs) as pool:
        rows = list(pool.map(_of, episodes(given)))
    pairs = zip(rows[::2], rows[1::2], strict=True)
    return {"rows": [row for pair in pairs if None not in pair for row in pair]}


if __name__ == "__main__":
    parser = study.options(__doc__, "weak_joints", "a Panda behind position servos, one room")
    add = parser.add_argument
    add("--arms", nargs="+", choices=ARMS, default=list(SHOWN), help="which (default six)")
    add("--drives", nargs="+", choices=DRIVES, default=list(DRIVES), help="which")
    add("--rooms", nargs="+", type=float, default=list(ROOMS), help="which (default %(default)s)")
    add("--jobs", type=int, default=1, help="processes (default %(default)s)")
    add("--seeds", type=int, default=1, help="circles of each (default %(default)s)")
    study.on_record(
        parser.parse_args(), "Joints that lost torque, reported at once", _ridden, tables,
        (LIMITATION,),
    )  # fmt: skip
