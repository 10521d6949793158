"""Holt and Desrochers 1994 made again: a PUMA keeps its tool where it is in space while its platform turns.

The platform steps by 10 and by 30 deg under an arm with joint servos of 0.1 s, sampled at 10 Hz: the law of
the paper (J-dagger with the nominal attitude of the base), the bounded QP with an estimated attitude, and the
same with its set points held back. Beside that the gain that each attitude error of the base allows.

    python studies/holt1994.py [--quick] [--out DIR] [--json]

Seconds on one core. Quick leaves the step of 10 deg out. The report and its pictures go to studies/results.
"""

from functools import partial
from typing import Any

import numpy as np
from papers.beside import Found, Row, told

import ftqp
from ftqp.app.scenario.setup import load
from ftqp.viz.figures.loop_picture import draw_loop

LAWS = {
    "the paper's law": ("approximate_pseudoinverse", ("base.attitude=nominal", "base.anti_windup=false")),
    "QP, rate limits, estimated attitude": (None, ("base.anti_windup=false",)),
    "the same, set points held back": (None, ()),
}
PUBLISHED = {(30, "the paper's law"): "17.1 cm"}
ALPHA = np.deg2rad(np.arange(0.0, 86.0, 5.0))
"""Attitude errors of the base [rad]."""


def overshoots(angle: int) -> dict[str, Any]:
    """The logs of all laws for a platform step of so many degrees."""
    return {
        name: load(f"puma-step-{angle}", choices, scheme=scheme).simulation(log="memory").run().log
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


if __name__ == "__main__":
    told("holt1994", "Holt and Desrochers 1994, made again", __doc__ or "", "holt1994.md", work)
