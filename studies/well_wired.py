"""ftqp beside a controller that is wired well: the demo's arm in physics, each joint locked in turn.

The scenario is `panda-unannounced`: a Panda behind servos of 15 Hz in MuJoCo, with gravity and noisy
encoders, goes round a circle of 0.3 m in 4 s, and at 2.2 s the brake of one joint closes. Four controllers
lead it: ftqp, not reported but with its detector; ftqp, reported at once; damped resolved rates, not reported
and reported. The rival is fed the measured joints, keeps limits of speed, acceleration and range, and leads
the same servos by its speed. It is tried with three gains in every row. The one that strays least there,
distance and turn of the tip together as the task weighs them, is published, as nobody could know it before.

    python studies/well_wired.py [--gains] [--quick] [--out DIR] [--json]

About two minutes on one core. With --gains the rival alone, with other gains, on the demo's lock.
"""

from typing import Any

import numpy as np
from bench import study
from bench.attitude import turned
from bench.tables import Table

import ftqp
from ftqp.app.scenario.setup import load
from ftqp.sim.rival import GAIN, ResolvedRates, ride, strayed

SCENARIO, DEMO = "panda-unannounced", "panda_joint3"
GAINS = (10.0, 20.0, 40.0, GAIN, 80.0, 120.0, 200.0)
TRIED = (0.5 * GAIN, GAIN, 2.0 * GAIN)
"""Gains of the rival in a row [1/s]."""
CONTROLLERS = ("ftqp, not reported", "ftqp, reported", "rates, not reported", "rates, reported")


def facts(t: Any, error: Any, turn: Any, v: Any, at: float, robot: ftqp.Robot, said: str) -> dict[str, Any]:
    """What one controller did [m, rad], and the largest share of a speed limit that a joint truly used."""
    since = t >= at
    return {
        "before": float(error[~since].max()),
        "after": float(error[since].max()),
        "end": float(error[-1]),
        "turned": float(turn[since].max()),
        "turned_end": float(turn[-1]),
        "weighted": float(np.hypot(error, robot.length * turn)[since].max()),
        "speed": float((np.abs(v) / robot.limits.v_max).max()),
        "said": said,
    }


def own(joint: str, told: bool) -> dict[str, Any]:
    """ftqp."""
    setup = load(SCENARIO, [f"faults.0.joint={joint}", f"faults.0.announced={'' if told else 'never'}"])
    result = setup.simulation(log="memory").run()
    log, (event,) = result.log, setup.schedule
    found = [one for one in setup.planner.findings if one.joint == joint]
    noticed = f", found after {1e3 * (found[0].detected_at - event.at):.0f} ms" if found else ""
    status = result.final_status.name
    turn = turned(setup.robot, log["q"], setup.path.sample(log["t"]).pose)
    return facts(log["t"], strayed(log), turn, log["v"], event.at, setup.robot, status + noticed)


def rival(joint: str, told: bool, gain: float = GAIN) -> dict[str, Any]:
    """Damped resolved rates."""
    setup = load(SCENARIO, [f"faults.0.joint={joint}"])
    rates = ResolvedRates(setup.robot, setup.planner.dt, gain=gain)
    done = ride(
        rates, setup.robot, setup.path, setup.q, dt=setup.planner.dt, plant=setup.plant,
        sensors=setup.sensors, schedule=setup.schedule, reported=told,
    )  # fmt: skip
    (event,) = setup.schedule
    turn = turned(setup.robot, done.q, setup.path.sample(done.t).pose)
    return facts(done.t, done.error, turn, done.v, event.at, setup.robot, f"goes on, gain {gain:g}")


def best(joint: str, told: bool) -> dict[str, Any]:
    """The rival with the gain that strays least here."""
    return min((rival(joint, told, gain) for gain in TRIED), key=lambda run: float(run["weighted"]))


def by_joint(quick: bool) -> list[dict[str, Any]]:
    """Every joint under every controller."""
    joints = ftqp.robots.load("panda").joints
    rows = []
    for joint in (DEMO,) if quick else joints:
        runs = (own(joint, False), own(joint, True), best(joint, False), best(joint, True))
        rows += [
            {"joint": joint, "controller": name} | run for name, run in zip(CONTROLLERS, runs, strict=True)
        ]
    return rows


def _best_bold(row: dict[str, Any], of: list[dict[str, Any]], what: str) -> str:
    """A figure in thousandths, bold where none of those rows has a lesser one."""
    text = f"{1e3 * row[what]:.2f}"
    least = min(round(1e3 * one[what], 2) for one in of)
    return f"**{text}**" if float(text) == least else text


def tables(found: dict[str, Any]) -> list[Table]:
    """A row for each joint and controller; the least of the controllers at a joint is bold."""
    lines = []
    for row in found["rows"]:
        of = [one for one in found["rows"] if one["joint"] == row["joint"]]
        cells = [_best_bold(row, of, what) for what in ("before", "after", "end", "turned", "turned_end")]
        joint, fastest = row["joint"].removeprefix("panda_"), f"{100 * row['speed']:.0f} %"
        lines.append((joint, row["controller"], *cells, fastest, row["said"]))
    headings = (
        "joint", "controller", "before the lock [mm]", "after it [mm]", "at the end [mm]",
        "turned at most [mrad]", "at the end [mrad]", "fastest joint", "ends",
    )  # fmt: skip
    notes = (
        "Largest and last distances of the true tip from its target; `fastest joint` is the largest share of "
        "its speed limit that a joint truly had.",
        f"The rival's gain is the best of {', '.join(f'{gain:g}' for gain in TRIED)} 1/s in each row; ftqp "
        "and its detector have their defaults.",
    )
    title = "The brake of one joint closes"
    return [Table(title=title, headings=headings, rows=lines, notes=notes, text_last=True)]


def main() -> None:
    """The command line."""
    parser = study.options(__doc__, "well_wired", "the demo's joint only")
    parser.add_argument("--gains", action="store_true", help="the rival alone, with other gains")
    given = parser.parse_args()
    if given.gains:
        print("gain [1/s]   reported   after the lock [mm]   at the end [mm]")
        for gain in GAINS:
            for told in (False, True):
                run = rival(DEMO, told, gain)
                said = f"{gain:10.0f}   {'yes' if told else 'no':4}"
                print(f"{said}   {1e3 * run['after']:19.2f}   {1e3 * run['end']:15.2f}")
        return
    study.on_record(
        given, "Beside a controller that is wired well", lambda given: {"rows": by_joint(given.quick)},
        tables, ("One arm, one path, one instant, one noise, and a rival of one kind.",),
    )  # fmt: skip


if __name__ == "__main__":
    main()
