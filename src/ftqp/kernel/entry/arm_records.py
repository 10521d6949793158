"""Records of many arms side by side, begun, given faults and stepped in compiled calls."""

from typing import Any, final

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.kernel.entry.planner_commands import PlannerCommands, ReserveSamples
from ftqp.kernel.entry.session import Session, bound, share_out
from ftqp.kernel.layout.enums import TARGET_SIZE
from ftqp.kernel.layout.record import dtype, in_line, used_words, zeros_in_line

PORTION = 500
"""A thread is begun for so many ticks at least: about what beginning it takes."""


@final
class ArmRecords:
    """Arms that all begin as one session, which stays as it is; its commands tell it the rest."""

    def __init__(
        self, session: Session, commands: PlannerCommands, samples: ReserveSamples | None, count: int,
        joints: int, threads: int,
    ) -> None:  # fmt: skip
        self._count, self._joints, self._threads = count, joints, threads
        self._records, self._givens = zeros_in_line(dtype("record"), count), np.zeros(count, dtype("given"))
        self._works = zeros_in_line(dtype("free"), count)
        self._model, self._what, self._arm = session.memory, commands.memory, in_line(commands.arm)
        self._lent = session, commands  # what the records point at lives as long
        self._rows = np.zeros(1) if samples is None else samples.rows
        self._samples = 0 if samples is None else len(samples.rows)
        self._shares = np.zeros(1, dtype("reserve"))
        self.targets: FloatArray = np.zeros((count, TARGET_SIZE))
        self.q, self.v = np.zeros((count, joints)), np.zeros((count, joints))
        self.mask: BoolArray = np.ones(count, dtype=bool)  # which arms take part in a step
        self.sent = np.zeros((count, 2, joints))  # positions and velocities that the drives are told
        # what is counted on of each joint: 0 nothing, 1 that it is locked, 2 that it swings freely
        self.found: IntArray = np.zeros((count, joints), dtype=np.int64)
        self.status, self.error = np.zeros(count, dtype=np.int64), np.zeros((count, 2))
        self.poses: FloatArray = np.zeros((count, 4, 4))  # as ``find_poses`` left them
        self._step = bound(
            "step_arms", self._records, self._givens, self._works, self.mask, self.targets, self.q, self.v,
            self.sent, self.found, self.status, self.error, count, joints,
        )  # fmt: skip

    def begin(self, mask: BoolArray) -> None:
        """Make the arms that are meant what the session was, at rest or moving as ``q`` and ``v`` say."""
        used = used_words(self._joints)
        call = bound(
            "begin_arms", self._model, used, len(used), self._what, self._records, self._givens, self._works,
            mask, self.q, self.v, self.found, self._count, self._joints,
        )  # fmt: skip
        share_out(lambda first, last: call(first, last), self._count, self._threads)

    def tell(self, fault: Any, mask: BoolArray, news: BoolArray, goes_on: BoolArray, weak: bool) -> None:
        """Let arms of a mask count on a ``fault``, (1,), that is news to some and goes on in some."""
        bound(
            "tell_arms", self._records, self._givens, self._arm, fault, mask, news, goes_on, self._count,
            int(weak), self._rows, self._samples, self._shares, self.found,
        )()  # fmt: skip

    def step(self, ticks: int) -> int:
        """So many ticks of each arm: 0, or a mistake in a target."""
        threads = max(1, min(self._threads, self._count * ticks // PORTION))
        if threads == 1:
            return self._step(ticks, 0, self._count)
        return share_out(lambda first, last: self._step(ticks, first, last), self._count, threads)

    def find_poses(self, q: FloatArray) -> None:
        """The end effector of each arm at q, (count, joints), into ``poses``."""
        bound("poses", self._arm, q, self.poses, self._count)()
