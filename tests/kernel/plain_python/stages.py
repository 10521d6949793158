"""An arm of four joints somewhere in the cascade, and parts of the cascade that answer what a test says."""

from typing import Any

from records import empty_record

from ftqp.kernel.judge import fallback_cascade
from ftqp.kernel.layout.enums import ACCELERATION, MAIN_STAGE, SLACK

N, DT = 4, 0.01


def record(stage: int = MAIN_STAGE, mode: int = SLACK, **cascade_is: Any) -> Any:
    """An arm of four joints that work, somewhere in the fallback cascade."""
    K = empty_record()
    K.chain.n, K.state.dt, K.state.level = N, DT, ACCELERATION
    K.faults.order[:N], K.faults.working, K.faults.movable = range(N), N, N
    K.limits.q_min[:], K.limits.q_max[:], K.limits.v_max[:], K.limits.a_max[:] = -1.0, 1.0, 2.0, 5.0
    K.task.m, K.task.mode, K.task.scale = 2, mode, 1.0
    K.qp.nx, K.qp.meq, K.qp.warm = N, 2, 7
    K.qp.lb[:N], K.qp.ub[:N] = -5.0, 5.0
    K.cascade.stage, K.cascade.jump, K.watch.fallback_limit = stage, 1.0, 3
    for name, value in cascade_is.items():
        K.cascade[name] = value
    return K


def stubs(monkeypatch: Any, **said: Any) -> list[str]:
    """Parts of the cascade that answer what the test says, and the names of those that were asked."""
    usual = {"command": None, "send": None, "pass_gate": True, "report_status": lambda *given: given[-1]}
    return answers(monkeypatch, fallback_cascade, **usual | said)


def answers(monkeypatch: Any, module: Any, **said: Any) -> list[str]:
    """Functions that a module calls, which answer what the test says, and the names of those asked."""
    asked: list[str] = []
    for name, value in said.items():

        def part(*given: Any, name: str = name, value: Any = value) -> Any:
            asked.append(name)
            return value(*given) if callable(value) else value

        monkeypatch.setattr(module, name, part)
    return asked
