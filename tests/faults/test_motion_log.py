"""The motion in the log of a run: what a calibration is given, and which runs it refuses."""

from typing import Any

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError
from ftqp.faults.motion_log import motion_of
from ftqp.sim.log.log_arrays import Log

DT = 1e-3
JOINTS = ("a", "b")


def kept_log(without: str = "", **about: Any) -> Log:
    """The log of a run of a two-joint arm, some columns left out."""
    groups = ("truth", "belief", "a", "tau", "q_measured", "q_reference", "v_reference", "tau_measured")
    signals: dict[str, Any] = {"t": DT * np.arange(5)}
    for number, group in enumerate((*groups, "tau_demand")):
        for i, joint in enumerate(JOINTS):
            known = group not in ("truth", "belief")
            signals[f"{group}.{joint}"] = np.full(5, 10.0 * number + i if known else 0.0)
    signals = {name: column for name, column in signals.items() if name.split(".")[0] != without}
    return Log(None, signals, {}, {}, {"joints": list(JOINTS), "dt": DT, "drive": "position"} | about)


def test_a_run_gives_what_its_detector_would_have_been_given() -> None:
    log = kept_log()
    motion = motion_of(log, JOINTS, DT, "position")
    pairs = {
        "q": "q_measured", "q_ref": "q_reference", "v_ref": "v_reference", "a_ref": "a",
        "tau": "tau_measured", "effort": "tau_demand",
    }  # fmt: skip
    for name, column in pairs.items():
        assert (getattr(motion, name) == log[column]).all()


def test_the_effort_of_a_torque_arm_is_what_was_sent() -> None:
    log = kept_log(drive="torque")
    motion = motion_of(log, JOINTS, DT, "torque")
    assert motion.effort is not None and (motion.effort == log["tau"]).all()


@pytest.mark.parametrize(
    ("log", "sentence"),
    [
        (kept_log(joints=["a", "c"]), "has joints"),
        (kept_log(dt=2e-3), "has dt 0.002, but the detector has 0.001"),
        (kept_log(drive="velocity"), "has drive velocity"),
        (kept_log("q_reference"), "does not keep the planner's reference"),
    ],
)
def test_a_run_of_something_else_is_refused(log: Log, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        motion_of(log, JOINTS, DT, "position")


@pytest.mark.parametrize("whose", ["truth", "belief"])
def test_a_run_in_which_a_joint_fails_is_not_healthy(whose: str) -> None:
    healthy = kept_log()
    signals = {name: healthy[name].copy() for name in healthy.names}
    signals[f"{whose}.b"][3:] = 1
    log = Log(None, signals, healthy.units, healthy.descriptions, healthy.metadata)
    with pytest.raises(InputError, match=r"not healthy: b fails, or is believed to, at 0.003 s"):
        motion_of(log, JOINTS, DT, "position")


def test_a_detector_calibrates_on_the_log_of_a_run() -> None:
    robot = ftqp.robots.load("planar", lengths=[0.5, 0.5]).with_limits(a_max=20.0)
    random, t = np.random.default_rng(0), DT * np.arange(60_000)
    q = np.stack([np.sin(t), 0.5 * np.cos(1.3 * t)], axis=1)
    v = np.stack([np.cos(t), -0.65 * np.sin(1.3 * t)], axis=1)
    a = np.stack([-np.sin(t), -0.845 * np.cos(1.3 * t)], axis=1)
    seen = np.vstack([q[:1], q[:-1]]) + 1e-4 * random.standard_normal(q.shape)
    signals: dict[str, Any] = {"t": t}
    groups = {"q_measured": seen, "q_reference": q, "v_reference": v, "a": a, "truth": 0 * q, "belief": 0 * q}
    for group, columns in groups.items():
        signals |= {f"{group}.{joint}": columns[:, i] for i, joint in enumerate(robot.joints)}
    log = Log(None, signals, {}, {}, {"joints": list(robot.joints), "dt": DT, "drive": None})
    blank = ftqp.Detector(robot=robot, dt=DT, noise=ftqp.Noise(q=1e-4))
    found = blank.calibrate(log).calibration
    assert found is not None and found.sigma == pytest.approx(1e-4, rel=0.1)
    assert found.hours == pytest.approx(60.0 / 3600.0)
    assert blank.calibrate([log, log]).calibration.hours == pytest.approx(120.0 / 3600.0)
