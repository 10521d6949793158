"""Which joint of an arm has failed, how and since when, whatever of its torques is known."""

import numpy as np
import pinocchio as pin
import pytest

import ftqp

DT, SIGMA = 1e-3, 1e-5
AT = 500
"""The tick at which the joint fails; every joint moves by then, and the detector knows what is usual."""
TAU_MAX = np.array([300.0, 120.0, 40.0])
POSITION, SPEED = 400.0, 40.0
"""Gains of the loop around the reference [1/s^2, 1/s]."""
BRAKING = 0.01
"""How long a brake takes [s]."""
KNOWN = {
    "torques sent": ("torque", False, False),
    "torques sent and measured": ("torque", True, False),
    "torques demanded": ("position", False, True),
    "torques measured": ("position", True, False),
    "no torques": ("position", False, False),
}
"""The drive, whether the motors' torques are measured, and whether the drive tells what it asks them for."""


@pytest.fixture(scope="module")
def arm():
    """A vertical arm of three joints with limits of its torques."""
    planar = ftqp.robots.load("planar", count=3, vertical=True)
    limits = {"q_min": -2.6, "q_max": 2.6, "v_max": 2.0, "a_max": 20.0, "tau_max": TAU_MAX.tolist()}
    return ftqp.Robot.from_pinocchio(planar.model, "tip", limits=limits, name="arm")


def reference(tick):
    """q, v and a of the reference."""
    t, rate = DT * (500 + tick), 1.0 + 0.2 * np.arange(3)
    q = np.array([0.3, 0.8, -0.5]) + 0.6 / rate * (1.0 - np.cos(rate * t))
    return q, 0.6 * np.sin(rate * t), 0.6 * rate * np.cos(rate * t)


def driven(arm, known, fault="", joint=0, share=1.0, most=160, at=AT):
    """The tick after the failure at which something was found, or ``most``, and the diagnosis.

    Physics under computed torques: ``share`` of its torque is left to a joint, it is ``locked`` by its
    brake, or it ``runs`` with all of its torque.
    """
    drive, measured, demands = KNOWN[known]
    watch = ftqp.Detector(robot=arm, dt=DT, drive=drive, noise=ftqp.Noise(q=SIGMA, tau=0.01))
    model, data, rng = arm.model, arm.model.createData(), np.random.default_rng(0)
    q, v, _ = reference(0)
    others, given = [i for i in range(3) if i != joint], np.zeros(3)
    for k in range(at + most):
        q_r, v_r, a_r = reference(k)
        asked = pin.rnea(model, data, q, v, a_r + POSITION * (q_r - q) + SPEED * (v_r - v))
        asked = np.clip(asked, -TAU_MAX, TAU_MAX)
        before, given = given if k else asked, asked.copy()
        if k >= at and fault == "share":
            given[joint] *= share
        elif k >= at and fault == "runs":
            given[joint] = TAU_MAX[joint]
        ahead = reference(k + 1)
        step = ftqp.Commanded(ahead[0], ahead[1], a_r, tau=asked if drive == "torque" else None,
                              demand=asked if demands else None)  # fmt: skip
        sample = q + SIGMA * rng.standard_normal(3)
        diagnosis = watch.update(sample, None, before if measured else None, step)
        if diagnosis.isolated:
            return k - at, diagnosis
        if k >= at and fault == "locked":
            a = np.zeros(3)
            a[joint] = -v[joint] / max((1.0 - DT * (k - at) / BRAKING) * BRAKING, DT)
            M, h = pin.crba(model, data, q), pin.rnea(model, data, q, v, a)
            M = np.triu(M) + np.triu(M, 1).T
            a[others] = np.linalg.solve(M[np.ix_(others, others)], (given - h)[others])
        else:
            a = pin.aba(model, data, q, v, given)
        q, v = q + DT * v + 0.5 * DT * DT * a, v + DT * a
    return most, diagnosis


@pytest.mark.parametrize("known", KNOWN)
def test_a_healthy_arm_raises_no_suspicion(arm, known):
    _, diagnosis = driven(arm, known, most=300)
    assert not diagnosis.isolated and not diagnosis.watching and diagnosis.suspicion < 0.5


@pytest.mark.parametrize("known", KNOWN)
@pytest.mark.parametrize(
    ("kind", "fault", "joint", "share", "within"),
    [
        ("locked", "locked", 0, 1.0, 40),
        ("locked", "locked", 2, 1.0, 40),
        ("runaway", "runs", 1, 1.0, 10),
        ("runaway", "runs", 2, 1.0, 10),
        ("free_swinging", "share", 0, 0.0, 60),
        ("degraded", "share", 0, 0.5, 160),
    ],
)
def test_joint_kind_and_onset_are_found(arm, known, kind, fault, joint, share, within):
    tick, diagnosis = driven(arm, known, fault, joint, share)
    if known == "torques measured" and fault == "share":  # the motor gives what it is said to give
        assert not diagnosis.isolated and diagnosis.watching and diagnosis.suspect == "j1"
        return
    assert tick < within and list(diagnosis.isolated) == [f"j{joint + 1}"]
    found = diagnosis.isolated[f"j{joint + 1}"]
    assert found.kinds == {kind} and found.onset == pytest.approx(DT * AT, abs=10 * DT)
    if kind == "degraded":
        assert found.share == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("known", ["torques sent", "torques sent and measured", "torques demanded"])
def test_lost_torque_is_not_found_within_the_first_tenth_of_a_second(arm, known):
    """What a reset leaves in the observers, and friction that comes loose, look like it."""
    tick, diagnosis = driven(arm, known, "share", 0, 0.0, most=400, at=10)
    assert 0.09 <= DT * tick < 0.25 and list(diagnosis.isolated) == ["j1"]


def test_joint_that_stands_is_found_at_once(arm):
    tick, diagnosis = driven(arm, "torques sent", "locked", 0, at=10)
    assert DT * tick < 0.08 and diagnosis.isolated["j1"].kinds == {"locked"}
