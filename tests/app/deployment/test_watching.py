"""The detector in a library in C finds what Python's finds, in the same ticks and with the same numbers."""

import ctypes

import numpy as np
import pytest
from deployed_library import library
from tests.app.deployment.test_library import MISTAKES, Library, fault_of, numbers

import ftqp
from ftqp.app.deployment.arm_file import arm_file
from ftqp.app.deployment.built_folder import Wanted, build_folder

PANDA = ftqp.robots.load("panda")
DT, NOISE = 1e-3, ftqp.Noise(q=1e-5, tau=0.05)
DRIVE = ftqp.Drive(kind="torque", inertia_error=0.0)
LOCKED, TICKS, STUCK = 3, 1200, 400
KINDS = {"locked": 1, "free_swinging": 2, "degraded": 4, "runaway": 8, "sensor_frozen": 16}


class Finding(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_int32) for name in ("joint", "kinds")),
        *((name, ctypes.c_double) for name in ("probability", "onset", "detected_at", "share")),
    )


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A library with a detector."""
    folder = tmp_path_factory.mktemp("watching") / "built"
    planner = ftqp.Planner(PANDA, DT, drive=DRIVE, noise=NOISE, detector=ftqp.Detector())
    build_folder(
        Wanted(
            planner=planner, name="panda", target="host", cpu=None, embed=False, folder=folder, detects=True
        )
    )
    return folder


@pytest.mark.long
def test_findings_are_those_of_python(built):
    planner = ftqp.Planner(PANDA, DT, drive=DRIVE, noise=NOISE)
    looks = ftqp.Detector().for_arm(PANDA, DT, drive=DRIVE, noise=NOISE)
    watched = ftqp.Planner(PANDA, DT, drive=DRIVE, noise=NOISE, detector=ftqp.Detector())
    arm = Library(built, arm_file(watched.deployable(), 7, detects=True))
    rng, q = np.random.default_rng(0), PANDA.neutral.copy()
    path = ftqp.paths.Circle(PANDA.pose(q), radius=0.1, duration=2.0)
    motion = path.sample(np.arange(TICKS) * DT)
    targets = ftqp.Targets(motion.pose, motion.twist, motion.acceleration)
    planner.reset(q)
    looks.reset(q)
    assert arm.open() == arm.reset(q) == 0
    said = []
    for k in range(TICKS):
        measured = q + rng.normal(0.0, NOISE.q, 7)
        step = planner.step(measured, None, targets.at(k))
        diagnosis = looks.update(measured, None, None, step)
        assert arm.step(measured, targets.packed[k]) == step.code
        said.append(arm.call("watch", None))
        assert float(diagnosis.suspicion > 1.0) <= said[-1] or diagnosis.suspicion <= 1.0
        stuck = q[LOCKED]
        q = step.q.copy()
        if k >= STUCK:
            q[LOCKED] = stuck
    assert 2 in said[STUCK:] and 2 not in said[:STUCK]
    (name, finding), *others = diagnosis.isolated.items()
    out = (Finding * 7)()
    assert not others and arm.call("detect", out, 7) == 1
    assert out[0].joint == PANDA.joint(name) == LOCKED
    assert out[0].kinds == sum(KINDS[kind] for kind in finding.kinds)
    assert (out[0].onset, out[0].detected_at) == (finding.onset, finding.detected_at)
    assert out[0].probability == 1.0 / len(finding.kinds)
    assert arm.call("report", fault_of(LOCKED, 1)) == 0 and arm.call("withdraw", LOCKED) == 0
    assert arm.call("detect", out, 7) == 0


@pytest.mark.long
def test_watching_says_what_it_lacks(built, panda_without):
    plain = ftqp.Planner(PANDA, DT)
    arm = Library(built, arm_file(plain.deployable(), 7))
    assert arm.call("watch", None) == MISTAKES["NOT_OPEN"]
    arm.open()
    arm.reset()
    arm.step()
    assert arm.call("watch", None) == arm.call("detect", None, 0) == MISTAKES["UNSUPPORTED"]
    watched = ftqp.Planner(PANDA, DT, drive=DRIVE, noise=NOISE, detector=ftqp.Detector())
    file = arm_file(watched.deployable(), 7, detects=True)
    assert panda_without(file) == MISTAKES["UNSUPPORTED"]
    arm = Library(built, file)
    arm.open()
    assert arm.call("watch", None) == MISTAKES["NOT_RESET"]
    arm.reset()
    arm.step()
    assert arm.call("watch", numbers(np.full(7, np.nan))) == 0
    assert arm.call("detect", None, 1) == MISTAKES["NULL"]


@pytest.fixture
def panda_without(tmp_path_factory):
    """Opens a file in a library without a detector."""
    folder = library("host", tmp_path_factory.mktemp("without") / "built")

    def opened(file):
        code = ctypes.CDLL(str(folder / "lib" / "libftqp.so"))
        return code.ftqp_size(file, ctypes.c_size_t(len(file)), ctypes.byref(ctypes.c_size_t()))

    return opened
