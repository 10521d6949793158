"""What a caller hands to a step, converted once; a wrong shape or type is one clear sentence."""

from operator import index
from typing import Any

import numpy as np

from ftqp.control.planner.stages import Tick
from ftqp.core.checks import FloatArray, numbers, shown, sized
from ftqp.core.errors import InputError
from ftqp.kernel.entry.planner_commands import PlannerCommands
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import Mistake
from ftqp.kernel.layout.thresholds import MOST_ROWS, MOST_TICKS

_MISTAKES: dict[int, str] = {
    Mistake.NOT_RESET: "the planner has no start; call planner.reset(q) before the first step",
    Mistake.NO_ROTATION: (
        "the task has rotation rows but the target has a position only; give Target(pose=...)"
    ),
    Mistake.TWIST_ALONE: (
        "the target has a twist alone and no place to be at; lead the planner by an "
        "ftqp.TargetFollower(planner), which keeps one"
    ),
    Mistake.NOT_READ: "target.packed is no longer an array of (29,) float64 numbers; make a new Target",
}


def not_a_target(given: Any, more: object = None) -> InputError:
    """The error for something else as the target or behind it, or for a target that was turned to no row."""
    if more is not None:
        return InputError(
            f"step got {shown(more)} behind its target, expected nothing; give tau, tip and ticks by name, "
            "for example step(q, v, target, tau=tau)"
        )
    row = getattr(given, "row", 0)
    if hasattr(given, "packed") and not is_row(row):
        return InputError(f"target.row is {shown(row)}, expected a whole number; take targets.at(k)")
    if given is None:
        return InputError(
            "step got no target; its second argument is the measured velocity, or None: step(q, None, "
            "target), or step(q, target=target)"
        )
    return InputError(f"target is {type(given).__name__}, expected ftqp.Target(pose=...)")


def is_row(row: Any) -> bool:
    """Whether this is the number of a row, as the kernel takes it; whether there is such a row, it sees."""
    try:
        return 0 <= index(row) < MOST_ROWS
    except TypeError:
        return False


def vector(name: str, value: Any) -> FloatArray:
    """``value`` as a contiguous vector of any size; NaN and infinities pass, they are the world's doing."""
    result = numbers(name, value)
    if result.ndim != 1:
        raise InputError(f"{name} has shape {result.shape}, expected a vector (nv,)")
    return result


def mistake(code: int, q: Any, v: Any, nv: int, nq: int) -> InputError:
    """The error for a mistake that the kernel has found in what a step was given."""
    if code in _MISTAKES:
        return InputError(_MISTAKES[code])
    expected = f"(nv,) = ({nv},)" if nq == nv else f"(nv,) = ({nv},) or (nq,) = ({nq},)"
    if np.shape(q) not in ((nv,), (nq,)):
        return InputError(f"q has shape {np.shape(q)}, expected {expected}")
    return InputError(f"v has shape {np.shape(v)}, expected (nv,) = ({nv},)")


def converted_tick(tick: Any, q: Any, v: Any, target: tuple[Any, ...]) -> int:
    """A tick; where q or v cannot be read as they are, with copies of them as vectors."""
    code: int = tick(q, v, *target)
    if code == Mistake.NOT_READ:
        code = tick(vector("q", q), vector("v", v), *target)
    return code


def measured_tick(
    session: Session, tick: Any, q: Any, v: Any, target: tuple[Any, ...], tau: Any, tip: Any
) -> int:
    """A tick with measured torques or a measured tip."""
    state, task = session.K.state, session.K.task
    finite = tau is None or bool(np.isfinite(sized("tau", tau, (int(session.K.chain.n),))).all())
    pose = None if tip is None else sized("tip", getattr(tip, "homogeneous", tip), (4, 4))
    try:
        state.unusable = not finite
        if pose is not None:
            task.tip_measured[:] = pose
            task.has_tip_measured = 1
        return converted_tick(tick, q, v, target)
    finally:
        task.has_tip_measured = state.unusable = 0


def whole_ticks(ticks: Any) -> int:
    """How many periods have passed, checked."""
    try:
        count = index(ticks)
    except TypeError:
        count = 0
    if count < 1:
        raise InputError(
            f"ticks is {shown(ticks)}, expected how many dt the last step is ago, a whole number >= 1"
        )
    return count


def made_up_for(
    commands: PlannerCommands, tick: Tick, target: tuple[Any, ...], ticks: int, v: FloatArray
) -> None:
    """Do the ticks that were missed, with nothing measured and targets on the way to the given one."""
    packed, row = target
    for left in range(min(ticks, MOST_TICKS) - 1, 0, -1):
        code = commands.miss(packed, row, left)
        try:
            if code >= 0:
                code = tick(commands.expected, v, commands.target, 0)
        finally:
            commands.measure_again()
        if code < 0:
            raise mistake(code, commands.expected, v, len(v), len(v))
