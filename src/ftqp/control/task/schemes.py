"""The schemes of the field as short recipes, each at both levels, and the closed forms at the velocity level.

Source: Jin et al. 2017 and the works it builds on; the objectives at both levels are derived in
``docs/theory/schemes.md``.
"""

from collections.abc import Callable, Mapping
from typing import Any

from ftqp.control.task.resolvers import (
    Resolver,
    approximate_pseudoinverse,
    pseudoinverse,
    singularity_robust,
    weighted_pseudoinverse,
)
from ftqp.control.task.scheme import Scheme
from ftqp.core.checks import non_negative, positive
from ftqp.core.errors import InputError, nearest
from ftqp.core.setting import made_from
from ftqp.kernel.layout.criteria import Criterion


def mvn(gain: float = 4.0) -> Scheme:
    """Minimum velocity norm: 1/2 |a + gain v|^2, or 1/2 |v|^2.

    Args:
        gain: Decay of the null-space velocity, >= 0 [1/s], at the acceleration level only. A larger one stops
            self-motion sooner and with larger accelerations.
    """
    return Scheme(
        name="mvn",
        acceleration=Criterion(norm=1.0, norm_v=non_negative("gain", gain, "1/s")),
        velocity=Criterion(norm=1.0),
    )


def man() -> Scheme:
    """Minimum acceleration norm: 1/2 |a|^2, or 1/2 |v - v_previous|^2."""
    return Scheme(name="man", acceleration=Criterion(norm=1.0), velocity=Criterion(norm=1.0, norm_v=-1.0))


def mke(gain: float = 4.0) -> Scheme:
    """Minimum kinetic energy: 1/2 (a + gain v)' M (a + gain v), or 1/2 v'M v.

    Args:
        gain: Decay of the kinetic energy, >= 0 [1/s], at the acceleration level only. A larger one stops
            self-motion sooner and with larger accelerations.
    """
    return Scheme(
        name="mke",
        acceleration=Criterion(inertia=1.0, inertia_v=non_negative("gain", gain, "1/s")),
        velocity=Criterion(inertia=1.0),
    )


def mtn() -> Scheme:
    """Minimum torque norm: 1/2 |M a + h|^2; greedy, it tends to end in larger torques than it saves."""
    return Scheme(name="mtn", acceleration=Criterion(torque=1.0), velocity=Criterion(torque=1.0))


def iiwt() -> Scheme:
    """Inertia-inverse-weighted torque: 1/2 tau' M^-1 tau."""
    return Scheme(
        name="iiwt",
        acceleration=Criterion(inertia=1.0, inertia_h=1.0),
        velocity=Criterion(inertia=1.0, inertia_v=-1.0, inertia_h=1.0),
    )


def rmp(mu: float = 4.0, nu: float = 4.0) -> Scheme:
    """Repetitive motion: 1/2 |a + (mu + nu) v + mu nu (q - posture)|^2, or 1/2 |v + mu (q - posture)|^2.

    Args:
        mu: First gain of the return to the posture, >= 0 [1/s]. A larger one pulls harder towards the posture
            and moves the joints more.
        nu: Second gain of the return to the posture, >= 0 [1/s], at the acceleration level only.
    """
    mu, nu = non_negative("mu", mu, "1/s"), non_negative("nu", nu, "1/s")
    return Scheme(
        name="rmp",
        acceleration=Criterion(norm=1.0, norm_v=mu + nu, norm_q=mu * nu),
        velocity=Criterion(norm=1.0, norm_q=mu),
    )


def dlsm(
    alpha: float = 0.995, mu: float = 4.0, nu: float = 4.0, tau_ref: float = 1.0, a_ref: float = 1.0
) -> Scheme:
    """Different-level simultaneous minimisation of torque and repetitive motion.

    alpha |tau/tau_ref|^2 + (1 - alpha) |(a + kappa)/a_ref|^2, kappa of ``rmp``.

    Args:
        alpha: Share of the torque norm, in [0, 1). Towards 1 torques are smaller at every tick and, being
            greedy, larger later.
        mu: First gain of the return to the posture, >= 0 [1/s]. A larger one pulls harder towards it.
        nu: Second gain of the return to the posture, >= 0 [1/s], at the acceleration level only.
        tau_ref: The torque that counts as one unit, > 0 [N m]. A larger one makes torques count less.
        a_ref: The acceleration that counts as one unit, > 0 [rad/s2]. A larger one makes the rest count less.
    """
    return _mix("dlsm", alpha, rmp(mu, nu), tau_ref, a_ref)


def dlsm_mvn(alpha: float = 0.995, gain: float = 4.0, tau_ref: float = 1.0, a_ref: float = 1.0) -> Scheme:
    """Different-level scheme with the velocity norm in place of repetitive motion.

    Args:
        alpha: Share of the torque norm, in [0, 1). Towards 1 torques are smaller at every tick and, being
            greedy, larger later.
        gain: Decay of the null-space velocity, >= 0 [1/s], at the acceleration level only. A larger one stops
            self-motion sooner.
        tau_ref: The torque that counts as one unit, > 0 [N m]. A larger one makes torques count less.
        a_ref: The acceleration that counts as one unit, > 0 [rad/s2]. A larger one makes the rest count less.
    """
    return _mix("dlsm_mvn", alpha, mvn(gain), tau_ref, a_ref)


def manipulability(gain: float = 0.1, rate: float = 4.0) -> Scheme:
    """A term to add to other schemes: it draws the null space up the gradient of the manipulability.

    The term is - gain x' d/dq log sqrt det(J J'), J of the joints that have not failed (times ``rate`` at the
    acceleration level): next to ``mvn`` the null-space velocity tends to gain times the gradient.

    Args:
        gain: How fast the arm moves up the gradient, >= 0 [rad2/s]. A larger one leaves singular postures
            sooner and moves the joints more.
        rate: How fast the velocity approaches that, >= 0 [1/s], at the acceleration level only; give it the
            ``gain`` of the ``mvn`` next to it.
    """
    gain, rate = non_negative("gain", gain, "rad2/s"), non_negative("rate", rate, "1/s")
    return Scheme(
        name="manipulability",
        acceleration=Criterion(manipulability=gain * rate),
        velocity=Criterion(manipulability=gain),
    )


def mvn_manipulability(gain: float = 0.1, rate: float = 4.0) -> Scheme:
    """Minimum velocity norm, drawn away from singularities: 1/2 |a + rate (v - gain d/dq log w)|^2.

    Args:
        gain: How fast the arm moves up the gradient of log w, w = sqrt det(J J'), >= 0 [rad2/s]. A larger one
            leaves singular postures sooner and moves the joints more.
        rate: Decay of the null-space velocity, >= 0 [1/s], at the acceleration level only. A larger one stops
            self-motion sooner.
    """
    return (mvn(rate) + manipulability(gain, rate)).named("mvn_manipulability")


def _mix(name: str, alpha: float, other: Scheme, tau_ref: float, a_ref: float) -> Scheme:
    share = non_negative("alpha", alpha)
    if not share < 1.0:
        raise InputError(f"alpha is {share:g}, expected a share in [0, 1); for torque alone use mtn")
    torque = share / positive("tau_ref", tau_ref, "N m") ** 2
    rest = (1.0 - share) / positive("a_ref", a_ref, "rad/s2") ** 2
    return (torque * mtn() + rest * other).named(name)


_CLOSED_FORMS = (pseudoinverse, weighted_pseudoinverse, singularity_robust, approximate_pseudoinverse)
_SCHEMES = (mvn, man, mke, mtn, iiwt, rmp, dlsm, dlsm_mvn, mvn_manipulability)
_RECIPES: dict[str, Callable[..., Scheme | Resolver]] = {
    one.__name__: one for one in (*_SCHEMES, *_CLOSED_FORMS)
}


def names() -> tuple[str, ...]:
    """The names that ``by_name`` knows."""
    return tuple(_RECIPES)


def closed_forms() -> tuple[str, ...]:
    """Those among ``names`` that are closed forms: velocity level, no QP, no backend."""
    return tuple(one.__name__ for one in _CLOSED_FORMS)


def recipe(name: str) -> Callable[..., Scheme | Resolver]:
    """The recipe of a scheme.

    Args:
        name: A name of ``names()``.

    Raises:
        InputError: The name is unknown.
    """
    if name not in _RECIPES:
        word, call, _ = str(name).partition("(")
        gains = ', and gains as a table, {"name": "dlsm", "alpha": 0.99}' if call else ""
        raise InputError(
            f"{name!r} is not a scheme{nearest(word, _RECIPES)}; there are {', '.join(_RECIPES)}{gains}"
        )
    return _RECIPES[name]


def by_name(given: "str | Mapping[str, Any] | Scheme | Resolver | None") -> Scheme | Resolver:
    """A scheme from its name, ``{"name": "dlsm", "alpha": 0.99}``, a scheme as it is, or None for mvn.

    Args:
        given: A name of ``names()``, a mapping with a name and parameters, a scheme, or None.

    Raises:
        InputError: The name or a parameter is unknown.
    """
    if given is None:
        return mvn()
    if isinstance(given, Scheme | Resolver):
        return given
    if isinstance(given, str):
        return recipe(given)()
    if not isinstance(given, Mapping) or "name" not in given:
        raise InputError(f"scheme is {given!r}, expected a name, {{name = ..., ...}} or an ftqp.Scheme")
    arguments = {key: value for key, value in given.items() if key != "name"}
    return made_from(recipe(str(given["name"])), arguments, f"scheme {given['name']!r}")
