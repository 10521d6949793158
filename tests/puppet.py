"""A backend that answers as it is told."""

from ftqp.qp.adapters.backend import Backend, Claim


class Puppet(Backend):
    """``answer`` gets the QP's buffers, writes what it likes and returns a claim."""

    package = "none"

    def __init__(self, answer):
        super().__init__("puppet")
        self._answer = answer

    def _prepare(self, qp):
        """Nothing to prepare."""

    def _run(self, qp, cold):
        return self._answer(qp)


def writes(value, claim=Claim.SOLVED):
    """An answer that is the same everywhere, and what is claimed of it."""

    def answer(qp):
        qp.solution[:] = value
        return claim

    return answer
