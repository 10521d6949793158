"""Records to run the kernel's helpers on, one at a time, compiled as the kernel compiles them."""

from collections.abc import Callable
from typing import Any

from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.layout.record import DTYPE, load_chain, record
from ftqp.model.robot import Robot


def on_record(function: Callable[[Any], Any]) -> Callable[[int], Any]:
    """A compiled function of a record's address that runs one helper of the kernel on that record."""

    @jit
    def run(address: int) -> Any:
        return function(carray(pointer(address), 1, DTYPE)[0])

    return run


def address(W: Any) -> int:
    """The address of the first record."""
    return int(W.ctypes.data)


def chain_record(robot: Robot) -> Any:
    """One record that holds the robot's chain and nothing else."""
    W = record()
    load_chain(W, **robot.chain.constants())
    return W


def limited_record(robot: Robot, dt: float) -> Any:
    """One record that holds the robot's chain and limits, sampled at ``dt``."""
    W = chain_record(robot)
    for name in ("q_min", "q_max", "v_max", "a_max", "tau_max"):
        W[name][0, : robot.nv] = getattr(robot.limits, name)
    W["a_brake"] = W["a_max"]
    W["dt"] = dt
    return W


def inputs(W: Any, q: Any, v: Any, target: Any) -> tuple[int, int, int, int, int]:
    """The arguments of ``entry.step`` for contiguous arrays that the caller keeps alive."""
    return address(W), q.ctypes.data, v.ctypes.data, target.ctypes.data, len(q)
