"""A planner in C beside the same planner in Python, and what both are told."""

import ctypes

import numpy as np

import ftqp
from ftqp.app.deployment.headers import arm_file

PANDA = ftqp.robots.load("panda")
MISTAKES = {
    "NOT_RESET": -3, "NULL": -20, "MISALIGNED": -21, "NOT_OPEN": -22, "NO_FILE": -23, "OTHER_FORMAT": -24,
    "OTHER_KERNEL": -25, "CUT_SHORT": -26, "CHECKSUM": -27, "NO_JOINT": -29, "BAD_FAULT": -30,
    "BAD_LOAD": -31, "BAD_TICKS": -32, "NOT_FINITE": -33, "UNSUPPORTED": -34,
    "BAD_SPEED": -35, "OTHER_ARM": -36, "BAD_LENGTH": -37,
}  # fmt: skip
KINDS = {"locked": 1, "free_swinging": 2, "degraded": 3}
SIGNALS = ("q", "v", "a", "tau")


class Fault(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_int32) for name in ("joint", "kind", "mode", "reset")),
        *((name, ctypes.c_double) for name in (
            "deceleration", "damping", "friction", "velocity", "acceleration", "torque", "q_min", "q_max",
        )),
    )  # fmt: skip


def fault_of(joint, kind, **left):
    nan = float("nan")
    healthy = {
        "velocity": 1.0,
        "acceleration": 1.0,
        "torque": 1.0,
        "deceleration": nan,
        "q_min": nan,
        "q_max": nan,
    }
    return ctypes.byref(Fault(joint=joint, kind=kind, **healthy | left))


class Finding(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_int32) for name in ("joint", "kinds")),
        *((name, ctypes.c_double) for name in ("probability", "onset", "detected_at", "share")),
    )


class Library:
    """The functions of the shared library on one planner, as numbers."""

    def __init__(self, built, file):
        self.code = ctypes.CDLL(str(built / "lib" / "libftqp.so"))
        self.code.ftqp_status_name.restype = self.code.ftqp_stop_reason_name.restype = ctypes.c_char_p
        for name in SIGNALS:
            getattr(self.code, f"ftqp_{name}").restype = ctypes.POINTER(ctypes.c_double)
        for name in ("clearance", "dt", "error", "progress"):
            getattr(self.code, f"ftqp_{name}").restype = ctypes.c_double
        self.file = file
        need = ctypes.c_size_t()
        assert self.size(file, ctypes.byref(need)) == 0
        self.room = np.zeros(need.value + 64, np.uint8)
        self.at = self.room.ctypes.data + -self.room.ctypes.data % 64

    def size(self, file, need):
        return self.code.ftqp_size(file, ctypes.c_size_t(len(file)), need)

    def call(self, name, *arguments):
        return getattr(self.code, f"ftqp_{name}")(ctypes.c_void_p(self.at), *arguments)

    def open(self, file=None):
        file = self.file if file is None else file
        return self.call("open", file, ctypes.c_size_t(len(file)))

    def reset(self, q=PANDA.neutral):
        return self.call("reset", numbers(q), None)

    def step(self, q=PANDA.neutral, target=None, ticks=1):
        target = ftqp.Target(pose=PANDA.pose(PANDA.neutral)).packed if target is None else target
        return self.call("step", numbers(q), None, numbers(target), ticks)

    def sent(self, name, n=7):
        """One signal of its last step."""
        return np.array(self.call(name)[:n])

    def has_sent(self, step, tick):
        """Its last step is one of Python, bit by bit."""
        for name in SIGNALS:
            said = f"{name} in step {tick}"
            np.testing.assert_array_equal(self.sent(name, len(step.q)), getattr(step, name), err_msg=said)


def numbers(values):
    return np.ascontiguousarray(values, dtype=float).ctypes.data_as(ctypes.c_void_p)


class Both:
    """A planner in Python and in C, which are told the same, and the arm that both command."""

    def __init__(self, built, planner, q=None, noise=0.0, lag=0.0):
        self.planner, self.noise, self.lag = planner, noise, lag
        self.arm = Library(built, arm_file(planner.deployable(), planner.robot.nv))
        self.q, self.steps = (planner.robot.neutral if q is None else q).copy(), 0
        self.rng = np.random.default_rng(3)
        planner.reset(self.q)
        assert self.arm.open() == self.arm.reset(self.q) == 0

    def step(self, target):
        measured = self.q + self.rng.normal(0.0, self.noise, self.q.shape)
        step = self.planner.step(measured, None, target)
        row = target.packed if target.packed.ndim == 1 else target.packed[target.row]
        assert self.arm.step(measured, row) == step.code, self.steps
        return self.moved(step)

    def moved(self, step):
        """The arm moves as both say, to the last bit."""
        self.arm.has_sent(step, self.steps)
        self.q = step.q + self.lag * (self.q - step.q)
        self.steps += 1
        return step

    def report(self, fault):
        self.planner.report(fault)
        given = {
            name: getattr(fault, name, None)
            for name in ("velocity", "acceleration", "torque", "q_min", "q_max")
        }
        left = {name: value for name, value in given.items() if value is not None}
        joint = self.planner.robot.joint(fault.joint)
        assert self.arm.call("report", fault_of(joint, KINDS[fault.kind], **left)) == 0

    def withdraw(self, joint):
        self.planner.withdraw(joint)
        assert self.arm.call("withdraw", self.planner.robot.joint(joint)) == 0
