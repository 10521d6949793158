"""A vertical arm of three joints under computed torques, one of which fails, and a detector that looks on."""

from typing import Any

import numpy as np
import pinocchio as pin

import ftqp

DT, SIGMA = 1e-3, 1e-5
AT = 100
"""The tick at which the joint fails; from the 80th on the detector knows what is usual."""
BEGIN = 900
"""The tick of the reference at which a ride begins: every joint moves by then."""
TAU_MAX = np.array([300.0, 120.0, 40.0])
POSITION, SPEED = 400.0, 40.0
"""Gains of the loop around the reference [1/s^2, 1/s]."""
BRAKING = 0.01
"""How long a brake takes [s]."""


def arm() -> ftqp.Robot:
    """The arm, with limits of its torques."""
    planar = ftqp.robots.load("planar", count=3, vertical=True)
    limits = {"q_min": -2.6, "q_max": 2.6, "v_max": 2.0, "a_max": 20.0, "tau_max": TAU_MAX.tolist()}
    return ftqp.Robot.from_pinocchio(planar.model, "tip", limits=limits, name="arm")


def reference(tick: int) -> tuple[Any, Any, Any]:
    """q, v and a of the reference."""
    t, rate = DT * tick, 1.0 + 0.2 * np.arange(3)
    q = np.array([0.3, 0.8, -0.5]) + 0.6 / rate * (1.0 - np.cos(rate * t))
    return q, 0.6 * np.sin(rate * t), 0.6 * rate * np.cos(rate * t)


def commanded(tick: int, tau: Any = None, demand: Any = None) -> ftqp.Commanded:
    """The reference at the end of a tick."""
    q, v, _ = reference(BEGIN + tick + 1)
    return ftqp.Commanded(q, v, reference(BEGIN + tick)[2], tau=tau, demand=demand)


def detector(drive: str = "torque", sigma: float = SIGMA, **settings: Any) -> ftqp.Detector:
    """A detector of this arm."""
    noise = ftqp.Noise(q=sigma, tau=0.01)
    return ftqp.Detector(robot=arm(), dt=DT, drive=drive, noise=noise, **settings)


def know_what_is_usual(watch: ftqp.Detector) -> Any:
    """Let so many ticks have passed that the detector relies on its means, which are nil; its record."""
    D = watch._session.D
    D.ticks, D.taken = D.ticks + 400, 200
    return D


def driven(watch: ftqp.Detector, fault: str = "", joint: int = 0, share: float = 1.0, *, most: int = 260,
           measured: bool = False, demands: bool = False) -> tuple[int, ftqp.Diagnosis]:  # fmt: skip
    """The tick at which a finding was made, or ``most``, and the diagnosis.

    Args:
        watch: The detector; with a torque drive it is told the torques that are sent.
        fault: ``share`` of its torque is left to a joint, it is ``locked``, or it ``runs`` with all of it.
        joint: Which one.
        share: What is left.
        most: Ticks.
        measured: Whether the motors' torques are measured.
        demands: Whether the drive tells what it asks its motors for.
    """
    model, limits = arm().model, TAU_MAX
    data, rng = model.createData(), np.random.default_rng(0)
    q, v, _ = reference(BEGIN)
    others = [i for i in range(3) if i != joint]
    given = np.zeros(3)
    for k in range(most):
        if k == AT - 20:
            know_what_is_usual(watch)
        q_r, v_r, a_r = reference(BEGIN + k)
        asked = pin.rnea(model, data, q, v, a_r + POSITION * (q_r - q) + SPEED * (v_r - v))
        asked = np.clip(asked, -limits, limits)
        before = given if k else asked
        given = asked.copy()
        if k >= AT and fault == "share":
            given[joint] *= share
        elif k >= AT and fault == "runs":
            given[joint] = limits[joint]
        sample = q + SIGMA * rng.standard_normal(3)
        sent = asked if watch._torques else None
        step = commanded(k, sent, asked if demands else None)
        diagnosis = watch.update(sample, None, before if measured else None, step)
        if diagnosis.isolated:
            return k, diagnosis
        if k >= AT and fault == "locked":
            left = 1.0 - DT * (k - AT) / BRAKING
            a = np.zeros(3)
            a[joint] = -v[joint] / max(left * BRAKING, DT)
            M, h = pin.crba(model, data, q), pin.rnea(model, data, q, v, a)
            a[others] = np.linalg.solve(M[np.ix_(others, others)], (given - h)[others])
        else:
            a = pin.aba(model, data, q, v, given)
        q, v = q + DT * v + 0.5 * DT * DT * a, v + DT * a
    return most, diagnosis
