"""What a first motion shows to be missing, or stated wrongly, of an arm; a sentence each."""

from typing import Final

import numpy as np

from ftqp.control.drive.learned_servos import SURE, LearnedServos
from ftqp.control.planner.planner import Planner
from ftqp.core.checks import FloatArray

WRONG: Final = 2.0
"""A bandwidth or a noise that is so many times too large or too small is said to be wrong."""
LAGS: Final = 5e-3
"""A servo that takes velocities lags by no more than its delays, about so much [s]."""
SCATTERS: Final = 5e-6
"""Noise below this [rad or m] is that of numbers or of encoders of 20 bits, and not worth to be stated."""
MOVED: Final = 0.01
"""A joint that went so far [rad or m] and is not known was too slow."""
SEEN, LEAST = 0.02, 1e-3
"""A joint that goes this share of the farthest one's way, and so far [rad or m], goes, too."""
FAR: Final = 0.5
"""A joint at this share of the largest place is not at zero."""
RULE: Final = "no acceleration limit"
"""How the finding of a model without acceleration limits begins."""


def said_of_stated(planner: Planner, learned: LearnedServos) -> list[str]:
    """What was stated of the servos and is not so."""
    drive, noise = planner.drive, planner.noise.q
    known, lag = learned.is_known, learned.lag
    certain = known & (lag > SURE * learned.lag_error)
    said = []
    slow = np.flatnonzero(certain & (lag - drive.latency > LAGS))
    if drive.takes_velocity and len(slow):
        names = ", ".join(learned.joints[i] for i in slow)
        said.append(
            f"The lag of {names} is up to {1e3 * lag[slow].max():.0f} ms, though the drive is said to take "
            "velocities: send step.v, too, or say ftqp.Drive(takes_velocity=False)."
        )
    elif drive.bandwidth is not None and not drive.takes_velocity:
        stated = np.broadcast_to(np.asarray(drive.bandwidth, dtype=float), lag.shape)
        own = np.maximum(lag - drive.latency, 1e-6)
        far = np.maximum(stated * own / 2.0, 2.0 / (stated * own)) > WRONG
        far &= np.abs(own - 2.0 / stated) > SURE * learned.lag_error
        if (known & far).any():
            wrong = known & far
            names = ", ".join(name for name, one in zip(learned.joints, wrong, strict=True) if one)
            said.append(
                f"{names}: a bandwidth of {_span(stated[wrong])} was stated, and they follow as with "
                f"{_span(2.0 / own[wrong])}; state that, or leave the bandwidth out."
            )
    seen = float(np.max(learned.noise))
    if 0.0 < WRONG * noise < seen:
        said.append(
            f"The noise of positions is stated as {noise:.2g}, and samples scatter by up to {seen:.2g}; "
            "state that, ftqp.Noise(q=...), or leave it out."
        )
    return said


def missing_of(planner: Planner, learned: LearnedServos) -> list[str]:
    """What was not stated, and what it would be good for."""
    robot, said = planner.robot, []
    for those, what in (
        (
            learned.way < MOVED,
            "hardly moved: a joint that has failed or has no room there stands, and a slow one needs longer; "
            "begin elsewhere, or give more seconds",
        ),
        (
            learned.way >= MOVED,
            "moved too slowly to tell lag from friction; it is estimated once they move faster",
        ),
    ):
        names = [learned.joints[i] for i in np.flatnonzero(~learned.is_known & those)]
        if names:
            said.append(f"Nothing was estimated of {', '.join(names)}, which {what}.")
    if planner.noise.q == 0.0 and np.max(learned.noise) > SCATTERS:
        said.append(
            f"The noise of positions was not stated: ftqp.Noise(q={float(np.max(learned.noise)):.2g}) is "
            "what samples scatter by, and an encoder that repeats itself then counts as frozen sooner."
        )
    if not robot.has_inertia:
        said.append(
            "The model has no masses: sag under the arm's weight is estimated anew at every posture, and no "
            "torque limit is kept."
        )
    elif not np.isfinite(robot.limits.tau_max).all():
        endless = np.flatnonzero(~np.isfinite(robot.limits.tau_max))
        said.append(
            f"No torque limit is known of {', '.join(robot.joints[i] for i in endless)}, so that none is "
            "kept: robot.with_limits(tau_max=...)."
        )
    said += [f"{str(one).rstrip('.')}." for one in robot.findings if str(one).startswith(RULE)]
    return said


def _span(bandwidths: FloatArray) -> str:
    """The least and the largest bandwidth, of some [rad/s]."""
    low, high = float(np.min(bandwidths)), float(np.max(bandwidths))
    if high < 1.05 * low:
        return f"{low:.3g} rad/s ({low / (2.0 * np.pi):.2g} Hz)"
    return f"{low:.3g} to {high:.3g} rad/s ({low / (2.0 * np.pi):.2g} to {high / (2.0 * np.pi):.2g} Hz)"


def strayed(names: tuple[str, ...], begun: FloatArray, way: FloatArray) -> str:
    """What is said of an arm that moves though it was sent to stay where it was measured.

    Two columns that are swapped draw their joints towards each other's place, a wrong sign one joint away
    from its own, degrees all joints away from zero or towards it.
    """
    moved = np.abs(way) > max(SEEN * float(np.abs(way).max()), LEAST)
    places = np.flatnonzero(moved)
    k = int(np.argmax(np.abs(way)))
    said = f"{names[k]} has moved by {way[k]:.2g} though it was sent to stay at {begun[k]:.2g}"
    if len(places) == 1:
        return (
            f"{said}: turn the sign of its measured or of its sent positions, or look at its zero, at the "
            "order of the columns, robot.joints, and at what drives it"
        )
    other = int(places[places != k][0])
    if len(places) == 2 and (begun[other] - begun[k]) * way[k] > 0.0 > (begun[other] - begun[k]) * way[other]:
        return (
            f"{said}, and {names[other]} by {way[other]:.2g}: their columns of measured or of sent "
            f"positions are swapped; put them in the order of robot.joints, {', '.join(names)}"
        )
    away = np.sign(way[moved] * begun[moved])
    far = np.abs(begun) > FAR * float(np.abs(begun).max())
    if not moved[far].all():  # degrees draw all joints that are not at zero
        away[:] = 0.0
    if (away > 0.0).all():
        return (
            f"{said}: all go away from zero, as if degrees were measured or sent where radians are due; hand "
            "over np.radians(q) of what is measured in degrees, and send step.q as it is"
        )
    if (away < 0.0).all():
        return f"{said}: all go towards zero, as if the arm took degrees; send np.degrees(step.q)"
    return f"{said}: look at zeros, signs, and the order of the columns, robot.joints"
