"""What a library in C notices is what Python notices, in the same ticks and with the same numbers."""

import ctypes

import numpy as np
import pytest
from tests.app.deployment.test_library import MISTAKES, Library

import ftqp
from ftqp.app.deployment.arm_file import arm_file

PANDA = ftqp.robots.load("panda")
DT, NOISE = 1e-3, ftqp.Noise(q=1e-5, tau=0.05)
DRIVE = ftqp.Drive(kind="torque", inertia_error=0.0)
LOCKED, TICKS, STUCK = 3, 1200, 900


class Finding(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_int32) for name in ("joint", "kinds")),
        *((name, ctypes.c_double) for name in ("probability", "onset", "detected_at", "share")),
    )


@pytest.mark.long
def test_findings_are_those_of_python(built):
    planner = ftqp.Planner(PANDA, DT, drive=DRIVE, noise=NOISE)
    arm = Library(built, arm_file(planner.deployable(), 7))
    rng, q = np.random.default_rng(0), PANDA.neutral.copy()
    path = ftqp.paths.Circle(PANDA.pose(q), radius=0.1, duration=2.0)
    motion = path.sample(np.arange(TICKS) * DT)
    targets = ftqp.Targets(motion.pose, motion.twist, motion.acceleration)
    planner.reset(q)
    assert arm.open() == arm.reset(q) == 0
    said = []
    for k in range(TICKS):
        measured = q + rng.normal(0.0, NOISE.q, 7)
        step = planner.step(measured, None, targets.at(k))
        assert arm.step(measured, targets.packed[k]) == step.code
        said.append(arm.call("watch", None))
        if planner.findings:
            break
        stuck = q[LOCKED]
        q = step.q.copy()
        if k >= STUCK:
            q[LOCKED] = stuck
    assert said[-1] == 2 and 2 not in said[:-1]
    (finding,) = planner.findings
    out = (Finding * 7)()
    assert arm.call("detect", out, 7) == 1
    assert out[0].joint == PANDA.joint(finding.joint) == LOCKED
    assert out[0].kinds == 1 and finding.kind == "locked"
    assert (out[0].onset, out[0].detected_at) == (finding.onset, finding.detected_at)
    assert out[0].probability == 1.0
    assert arm.call("watch", None) == 0 and arm.call("withdraw", LOCKED) == 0
    assert arm.call("detect", out, 7) == 0


@pytest.mark.long
def test_watching_says_what_it_lacks(built):
    arm = Library(built, arm_file(ftqp.Planner(PANDA, DT, detector=False).deployable(), 7))
    assert arm.call("watch", None) == MISTAKES["NOT_OPEN"]
    arm.open()
    arm.reset()
    arm.step()
    assert arm.call("watch", None) == arm.call("detect", None, 0) == MISTAKES["UNSUPPORTED"]
    arm = Library(built, arm_file(ftqp.Planner(PANDA, DT).deployable(), 7))
    arm.open()
    assert arm.call("watch", None) == MISTAKES["NOT_RESET"]
    arm.reset()
    arm.step()
    assert arm.call("watch", None) == 0
    assert arm.call("detect", None, 1) == MISTAKES["NULL"]
