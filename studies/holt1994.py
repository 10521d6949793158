"""Holt and Desrochers 1994 made again: a PUMA keeps its tool where it is in space while its platform turns.

The platform steps by 10 and by 30 deg under an arm with joint servos, sampled at 10 Hz: the law of the paper
(J-double-dagger with the nominal attitude of the base), the bounded QP with an estimated attitude, and the
same with its set points held back. Beside that the gain that each attitude error of the base allows.

The servos of the experiment are not in the paper. Ours, of first order and with a limit of 90 deg/s, have the
time constant with which Y of the step of 10 deg is nearest to its two published numbers; the rest follows.

    python studies/holt1994.py [--quick] [--out DIR] [--json]
    python studies/holt1994.py --figures DIR [--only 7]

Seconds on one core. Quick leaves the step of 10 deg out. The report and its pictures go to studies/results.
With --figures each figure and table of the paper is made by itself.
"""

import sys
import timeit
from functools import cache, partial
from typing import Any

import numpy as np
from papers.beside import Found, Row, Sheet, draw_loop, publish
from scipy.spatial.transform import Rotation

import ftqp
from ftqp.app.scenario.setup import load
from ftqp.sim.base.disturbances import Step
from ftqp.sim.base.moving_world import BaseMotion, Platform
from ftqp.sim.plants.plant import Arm
from ftqp.sim.plants.servo_plant import ServoPlant

LAWS = {
    "the paper's law": ("approximate_pseudoinverse", ("base.attitude=nominal", "base.anti_windup=false")),
    "QP, rate limits, estimated attitude": (None, ("base.anti_windup=false",)),
    "the same, set points held back": (None, ()),
}
PERIOD, SERVO = 0.1, 0.115
"""Sampling period, and the time constant of the servos, fitted on a grid of 5 ms (``fit``) [s]."""
PUBLISHED = {(30, "the paper's law"): "17.1 cm"}
ALPHA = np.deg2rad(np.arange(0.0, 86.0, 5.0))
"""Attitude errors of the base [rad]."""


def overshoots(angle: int) -> dict[str, Any]:
    """The logs of all laws for a platform step of so many degrees."""
    return {
        name: load(f"puma-step-{angle}", (*choices, f"simulation.servo.time_constant={SERVO}"), scheme=scheme)
        .simulation(log="memory")
        .run()
        .log
        for name, (scheme, choices) in LAWS.items()
    }


def sideways(log: Any) -> Any:
    """The tool's error along Y of space, (K,) [m]."""
    return log["target"][:, 1] - log["tip"][:, 1]


def overshoot(e: Any) -> float:
    """The largest error after the peak, against it [m]."""
    k = int(np.argmax(np.abs(e)))
    return max(0.0, float(-(np.sign(e[k]) * e[k:]).min()))


def work(quick: bool) -> Found:
    """All steps and laws, and the limit of the gain."""
    rows, pictures = [], {}
    for angle in (30,) if quick else (10, 30):
        logs = overshoots(angle)
        for name, log in logs.items():
            found = f"{100.0 * overshoot(sideways(log)):.1f} cm"
            rows.append(
                Row(
                    f"platform step of {angle} deg, overshoot Y: {name}",
                    PUBLISHED.get((angle, name), ""),
                    found,
                )
            )
        pictures[f"step-{angle}"] = partial(draw_step, angle, logs)
    limits = [ftqp.gain_limit(float(alpha)) for alpha in ALPHA]
    law = "that is the limit of stability, 2 cos alpha, and no gain to take; the best gain is cos alpha"
    rows.append(Row("base attitude error alpha that the law survives", "gain 2/sqrt(tan² alpha + 1)", law))
    pictures["gain"] = partial(draw_gain, limits)
    return Found(rows, pictures)


def draw_step(angle: int, logs: dict[str, Any], file: Any) -> None:
    """Errors over time."""
    curves = {name: (log["t"], 100.0 * sideways(log)) for name, log in logs.items()}
    draw_loop(file, f"The platform steps by {angle} deg", {"tool off along Y [cm]": curves})


def draw_gain(limits: Any, file: Any) -> None:
    """The limit and the best gain over the attitude error."""
    alpha = np.rad2deg(ALPHA)
    best = [ftqp.best_gain(float(one)) for one in ALPHA]
    panels = {"gain": {"largest stable": (alpha, limits), "best": (alpha, best)}}
    draw_loop(file, "What an attitude error of the base allows", panels, x_label="attitude error [deg]")


AXES, SHOWN = {"x": "cm", "y": "cm", "z": "cm", "orientation": "deg"}, 50
"""Errors with their units, and how many of their samples are drawn."""
LINES = {"x": "-", "y": "--", "z": ":", "inverse": ":", "pseudoinverse": "-", "J‡": "--"}
"""The lines of the paper's figures."""
PRINTED = {
    10: ((1.527, 3.825, 0.6366, 3.503), (1.54, 0.84, 1.70, 1.00)),
    30: ((17.37, 17.06, 12.53, 20.55), (1.97, 2.43, 1.66, 2.08)),
}
"""Tables 2 and 3: overshoots of x, y, z [cm] and orientation [deg], and 4 % settling times [s]."""


@cache
def step(angle: int, tau: float = SERVO) -> tuple[Any, Any, Any]:
    """A step under the paper's law: t (K,), error (K, 4) [cm, deg], control signals (K, 6) [deg].

    The law asks for what it likes, and the servos go at 90 deg/s at most; the platform turns at 80 deg/s.
    """
    arm = ftqp.robots.load("puma560")
    free = arm.with_limits(q_min=-10.0, q_max=10.0, v_max=1e3, a_max=1e9)
    planner = ftqp.Planner(
        free, PERIOD, level="velocity", scheme="approximate_pseudoinverse", task=ftqp.Task(calm=False),
        bounds=ftqp.Jin(upsilon=0.5 / PERIOD), emergency=None,
    )  # fmt: skip
    follower = ftqp.InertialTask(planner, ftqp.MovingBase(attitude="nominal"))
    platform = BaseMotion(
        Platform(), [Step("rotation", np.deg2rad(angle), rate=np.deg2rad(80.0))], PERIOD, 80
    )
    wide = arm.with_limits(q_min=-10.0, q_max=10.0, a_max=1e9)
    plant, q, v, model = (
        ServoPlant(wide, PERIOD, time_constant=tau),
        arm.neutral.copy(),
        np.zeros(6),
        Arm(free),
    )
    plant.reset(q, v)
    follower.reset(q)
    goal = platform.pose[0] @ model.tip(q)
    errors, controls = [], []
    for base in platform.pose:
        tip = base @ model.tip(q)
        turn = Rotation.from_matrix(goal[:3, :3] @ tip[:3, :3].T).as_rotvec()
        errors.append(np.concatenate([100.0 * (goal[:3, 3] - tip[:3, 3]), np.rad2deg(turn)]))
        done = follower.step(q, v, ftqp.Target(pose=goal), tip=tip)
        controls.append(np.rad2deg(PERIOD * done.v))
        plant.advance(done)
        q, v = plant.q.copy(), plant.v.copy()
    e = np.array(errors)
    way = e[np.flatnonzero(np.linalg.norm(e[:, 3:], axis=1) > 1e-4)[0], 3:]
    about = e[:, 3:] @ way / np.linalg.norm(way)
    return PERIOD * np.arange(len(e)), np.column_stack([e[:, :3], about]), np.array(controls)


def measures(angle: int, tau: float = SERVO) -> tuple[list[float], list[float]]:
    """Overshoots of x, y, z [cm] and orientation [deg], and times until 4 % of the peak [s]."""
    t, errors, _ = step(angle, tau)
    settled = [t[np.flatnonzero(np.abs(e) > 0.04 * np.abs(e).max())[-1]] + PERIOD for e in errors.T]
    return [overshoot(e) for e in errors.T], [float(value) for value in settled]


def fit() -> float:
    """The time constant whose Y after a step of 10 deg is nearest to the published one, relatively [s]."""

    def off(tau: float) -> float:
        over, settled = measures(10, tau)
        return (over[1] / PRINTED[10][0][1] - 1.0) ** 2 + (settled[1] / PRINTED[10][1][1] - 1.0) ** 2

    return min((round(0.005 * k, 3) for k in range(10, 41)), key=off)


def error_sheet(angle: int) -> Sheet:
    """Errors of position and orientation after a step."""
    t, errors, _ = step(angle)
    curves = {name: (t[:SHOWN], e[:SHOWN]) for name, e in zip(AXES, errors.T, strict=True)}
    panels = {f"error [{unit}]": {n: curves[n] for n in AXES if AXES[n] == unit} for unit in ("cm", "deg")}
    peaks = np.abs(errors).max(axis=0).tolist()
    ours = f"peaks {', '.join(f'{peak:.3g}' for peak in peaks[:3])} cm and {peaks[3]:.3g} deg"
    return Sheet(ours, {"peaks": peaks}, partial(draw_loop, panels=panels, styles=LINES))


def control_sheet(angle: int) -> Sheet:
    """What the law asks of the six joints after a step."""
    t, _, controls = step(angle)
    most = float(np.abs(controls).max())
    ours = f"at most {most:.3g} deg a sample, where the servos make {90.0 * PERIOD:g}"
    curves = {f"joint {i + 1}": (t[:SHOWN], u[:SHOWN]) for i, u in enumerate(controls.T)}
    return Sheet(ours, {"most": most}, partial(draw_loop, panels={"increment asked for [deg]": curves}))


def step_table(angle: int) -> Sheet:
    """Overshoot and settling time beside the published ones."""
    over, settled = measures(angle)
    rows = [["", "overshoot, published", "ours", "settled to 4 %, published", "ours"]]
    for k, (name, unit) in enumerate(AXES.items()):
        there, then = (column[k] for column in PRINTED[angle])
        rows.append(
            [name, f"{there:.4g} {unit}", f"{over[k]:.3g} {unit}", f"{then:.2f} s", f"{settled[k]:.1f} s"]
        )
    return Sheet(f"with servos of {SERVO:g} s", {"overshoot": over, "settled": settled}, table=rows)


def wrist(robot: Any, degrees: Any) -> Any:
    """The Jacobian of the wrist centre, in axes of the last link: [[B, 0], [D, E]]."""
    q = np.deg2rad(np.array(degrees, dtype=float))
    J, T = robot.jacobian(q), robot.pose(q)
    arm = -0.1 * T[:3, 2]
    J = np.vstack([J[:3] + np.cross(J[3:].T, arm).T, J[3:]])
    return np.vstack([T[:3, :3].T @ J[:3], T[:3, :3].T @ J[3:]])


def cut_pinv(J: Any) -> Any:
    """The pseudoinverse without singular values below 0.1."""
    U, s, Vt = np.linalg.svd(J)
    return Vt.T @ np.diag(np.where(s > 0.1, 1.0 / s, 0.0)) @ U.T


INVERSES = {
    "inverse": np.linalg.inv,
    "pseudoinverse": cut_pinv,
    "J‡": partial(ftqp.approximate_pinv, sigma_min=0.1),
}


def norm_sheet() -> Sheet:
    """Norms of the inverses round the hand-over-head singularity."""
    robot, sweep = ftqp.robots.load("puma560"), np.arange(-40.0, 40.0, 0.1) + 0.03
    every = [wrist(robot, [0.0, 36.3028 + x, 20.0, 17.19, 40.11, 0.0]) for x in sweep]
    norms = {name: np.array([np.linalg.norm(of(J), 2) for J in every]) for name, of in INVERSES.items()}
    peaks = {name: float(norms[name].max()) for name in norms if name != "inverse"}
    ours = (
        f"at most {peaks['pseudoinverse']:.3g} and {peaks['J‡']:.3g}; the inverse is cut at 40 in the picture"
    )
    panels = {"2-norm": {name: (sweep, np.minimum(values, 40.0)) for name, values in norms.items()}}
    label = "joint 2 beside the singularity [deg]"
    return Sheet(ours, peaks, partial(draw_loop, panels=panels, x_label=label, styles=LINES))


def cost_table() -> Sheet:
    """How long each inverse takes, against the first one in the same run."""
    J = wrist(ftqp.robots.load("puma560"), [0.0, 45.0, -180.0, 0.0, 45.0, 0.0])
    seconds = [min(timeit.repeat(partial(of, J), number=200, repeat=7)) for of in INVERSES.values()]
    ratios = [one / seconds[0] for one in seconds]
    rows = [
        ["", *INVERSES],
        ["published, ms on a 68030", "0.9", "25", "6"],
        ["its ratio", "1", "27.8", "6.7"],
    ]
    rows.append(["ours, ratio in one run", *(f"{one:.1f}" for one in ratios)])
    return Sheet(
        "by numpy, and `ftqp.approximate_pinv`, which checks its input", {"ratios": ratios}, table=rows
    )


def stretched_sheet() -> Sheet:
    """Control signals for 1 cm towards the boundary, near the stretched arm."""
    robot, elbow = ftqp.robots.load("puma560"), np.arange(-60.0, 60.0, 0.25) + 0.1
    every = [wrist(robot, [0.0, 20.0, -87.3084 + x, 0.0, 60.0, 0.0]) for x in elbow]
    lost = [
        np.linalg.svd(J[:3, :3])[0][:, 2] for J in every
    ]  # the direction that is lost where it is stretched
    asked = [0.01 * np.append(way * np.sign(way[0]), np.zeros(3)) for way in lost]
    control = np.rad2deg([INVERSES["J‡"](J) @ twist for J, twist in zip(every, asked, strict=True)])
    weak = float(np.abs(elbow[np.linalg.norm(control[:, :3], axis=1) < 1e-9]).max())
    inverse = np.minimum([1.0 / abs(np.linalg.det(J)) for J in every], 500.0)
    signals = {f"joint {i + 1}": (elbow, u) for i, u in enumerate(control.T)}
    panels = {"1/|det J|": {"1/|det J|": (elbow, inverse)}, "asked for [deg]": signals}
    ours = f"joints 1 to 3 are asked for nothing nearer than {weak:.1f} deg; 1/|det J| is cut at 500 here"
    return Sheet(
        ours, {"weak": weak}, partial(draw_loop, panels=panels, x_label="elbow from stretched [deg]")
    )


SHEETS = {
    "1": norm_sheet,
    "table 1": cost_table,
    **{
        name: partial(of, 10)
        for name, of in (("3", error_sheet), ("4", control_sheet), ("table 2", step_table))
    },
    **{
        name: partial(of, 30)
        for name, of in (("5", error_sheet), ("6", control_sheet), ("table 3", step_table))
    },
    "7": stretched_sheet,
}
"""The figures and tables of the paper that show a result."""


if __name__ == "__main__":
    title = "Holt and Desrochers 1994, made again"
    sys.exit(publish("holt1994", title, __doc__ or "", "holt1994.md", work, SHEETS))
