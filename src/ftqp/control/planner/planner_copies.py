"""What is made from a planner without changing it: arms like its own, what a lock costs, a library in C."""

from abc import ABC

from ftqp.control.paths.path import Path
from ftqp.control.planner.deployable import Deployable, deployable
from ftqp.control.planner.filled_rows import refuse_asking
from ftqp.control.planner.planner_changes import PlannerChanges
from ftqp.control.planner.solver.qp_solver import Solver
from ftqp.control.planner.ways.n_minus_one import Security
from ftqp.control.planner.ways.security_watch import SecurityWatch
from ftqp.control.planner.what_ifs import WhatIfs
from ftqp.core.errors import InputError


class PlannerCopies(PlannerChanges, ABC):
    """Copies of what a planner knows, for batches and for programs in C."""

    __slots__ = ("_solver", "_watch")
    _solver: Solver
    _watch: SecurityWatch | None

    @property
    def _asking(self) -> tuple[str, ...]:
        return self._tasks.asking + self._constraints.asking

    def _refuse_looking_ahead(self) -> None:
        """Refuse at once what ``n_minus_one`` would refuse when it looks ahead.

        Raises:
            InputError: No batch takes this planner.
        """
        try:
            refuse_asking(self._asking, "a batch", "make a planner without {them}")
            self._what_ifs()
        except InputError as error:
            raise InputError(
                f"n_minus_one looks ahead in a batch: {error}; or leave n_minus_one out"
            ) from error

    def what_ifs(self) -> WhatIfs:
        """What other arms like this one would begin with, for ``ftqp.batch``; nothing here changes.

        Raises:
            InputError: A foreign solver, or a plan.
        """
        refuse_asking(self._asking, "a batch", "make a planner without {them}")
        if not self._session.K.state.is_reset and self._tasks.begin_where_they_are:
            raise InputError(
                f"the task {self._tasks.begin_where_they_are[0]!r} has no target yet; give it one, or call "
                "planner.reset(q) first"
            )
        return self._what_ifs()

    def _what_ifs(self) -> WhatIfs:
        return WhatIfs(
            self._session, self._orders, self.robot, self._given, self._solver, self._wanted.reserve,
            self.faults, self._surroundings, self._tasks,
            [one.given for one in self._constraints.values()],
        )  # fmt: skip

    @property
    def security(self) -> Security | None:
        """What the lock of each joint would cost, as it was looked at last; None without ``n_minus_one``."""
        return None if self._watch is None else self._watch.security

    def foresee(self, path: Path | None, at: float = 0.0) -> None:
        """Say what the tip will follow, for ``n_minus_one``; a ``PathFollower`` says it by itself.

        Args:
            path: What it follows by the clock; None goes on with the target's twist.
            at: The time of the path at the next step [s].
        """
        if self._watch is not None:
            self._watch.foresee(path, at)

    def deployable(self) -> Deployable:
        """What this planner is without Python, for ``ftqp build``; nothing here changes.

        Raises:
            InputError: A foreign solver, a network, a closed form, a plan, further tasks, functions in
                Python, a cloud of balls, or faults that it already believes in.
        """
        self._heal()
        if self._surroundings is not None and len(self._surroundings.scene.balls):
            raise InputError(
                "the scene has a cloud of balls, which a library in C does not have; give what stands there "
                "names, scene.add(...), or take the cloud away, scene.update(np.zeros((0, 4)))"
            )
        return deployable(
            self._session, self._orders, self._given, self._solver, self._wanted, self._tasks,
            asking=self._asking,
            detector=None if self._fault_response is None else self._fault_response.detector.memory.copy(),
            has_scene=self._surroundings is not None,
        )  # fmt: skip
