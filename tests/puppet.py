"""A backend that answers as it is told."""

from collections.abc import Callable
from typing import Any

from ftqp.qp.adapters.backend import Backend, Claim


class Puppet(Backend):
    """``answer`` gets the QP's buffers, writes what it likes and returns a claim."""

    package = "none"

    def __init__(self, answer: Callable[[Any], Any]) -> None:
        super().__init__("puppet")
        self._answer = answer

    def _prepare(self, qp: Any) -> None:
        """Nothing to prepare."""

    def _run(self, qp: Any, cold: bool) -> Any:
        return self._answer(qp)


def writes(value: Any, claim: Any = Claim.SOLVED) -> Callable[[Any], Any]:
    """An answer that is the same everywhere, and what is claimed of it."""

    def answer(qp: Any) -> Any:
        qp.solution[:] = value
        return claim

    return answer
