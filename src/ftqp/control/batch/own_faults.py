"""The faults of each arm of a batch: who believes what from which tick on."""

from collections.abc import Sequence
from operator import index
from typing import Any, final

import numpy as np

from ftqp.control.planner.what_ifs import WhatIfs
from ftqp.core.checks import IntArray
from ftqp.core.errors import InputError
from ftqp.faults.kinds import KINDS, Fault, FreeSwinging
from ftqp.kernel.entry.rollouts import beliefs_of
from ftqp.model.robot import Robot

EXPECTED = "None, a fault, (fault, tick), or a list of those"


@final
class OwnFaults:
    """Faults by arm, in the form that compiled code takes.

    Attributes:
        events: Tick, index of what is then believed, and joint, (E, 3), by arm, then by tick.
        starts: Where the events of each arm begin, (B + 1,).
        beliefs: What is believed after each event.
        freed: Which joints of which arm swing freely sooner or later, (B, nv) truth values.
        later: Arms that are told of another fault while a joint swings freely, (B,) truth values.
    """

    def __init__(self, faults: Any, arms: int, robot: Robot, what_ifs: WhatIfs) -> None:
        self._robot, self._what_ifs = robot, what_ifs
        self._rooms: list[dict[str, Any]] = []
        self._known: dict[tuple[Fault, ...], int] = {}
        self._free_before = [robot.joint(f.joint) for f in what_ifs.told if isinstance(f, FreeSwinging)]
        self.freed, self.later = np.zeros((arms, robot.nv), dtype=bool), np.zeros(arms, dtype=bool)
        events: list[tuple[int, int, int]] = []
        starts = [0]
        known: dict[int, tuple[list[tuple[int, int, int]], list[int], bool]] = {}
        self._entries = _entries(faults, arms)
        for arm, entry in enumerate(self._entries):
            own = known.get(id(entry))  # many arms may be given the very same entry, which lives on
            if own is None:
                own = known[id(entry)] = self._events_of(arm)
            events += own[0]
            self.freed[arm, own[1]], self.later[arm] = True, own[2]
            starts.append(len(events))
        self.events: IntArray = np.array(events or [(0, 0, 0)], dtype=np.int64)
        self.starts: IntArray = np.array(starts, dtype=np.int64)
        self.beliefs = beliefs_of(self._rooms)

    def told(self, arm: int) -> list[tuple[Fault, int]]:
        """What one arm is told and at which tick, by tick."""
        return sorted(_told(self._entries[arm], arm), key=lambda pair: pair[1])

    def _events_of(self, arm: int) -> tuple[list[tuple[int, int, int]], list[int], bool]:
        """The events of one arm, its joints that swing freely, and whether it is told more while they do."""
        told: tuple[Fault, ...] = ()
        events, free = [], list(self._free_before)
        since, later = (0 if free else None), False
        for fault, tick in self.told(arm):
            told, joint = (*told, fault), self._robot.joint(fault.joint)
            events.append((tick, self._believed(told), joint))
            later = later or (since is not None and tick > since)
            if isinstance(fault, FreeSwinging):
                free.append(joint)
                since = tick if since is None else since
        return events, free, later

    def _believed(self, told: tuple[Fault, ...]) -> int:
        """The index of what is believed by an arm that was told of these faults."""
        if told not in self._known:
            self._known[told] = len(self._rooms)
            self._rooms.append(self._what_ifs.believing(told))
        return self._known[told]


def _entries(faults: Any, arms: int) -> Sequence[Any]:
    if faults is None:
        return [None] * arms
    if isinstance(faults, tuple(KINDS.values())) or not isinstance(faults, Sequence):
        raise InputError(f"faults is {faults!r:.60}, expected a list with one entry an arm: {EXPECTED}")
    if len(faults) != arms:
        raise InputError(f"faults has {len(faults)} entries, expected one for each of {arms} arms")
    return faults


def _told(entry: Any, arm: int) -> list[tuple[Fault, int]]:
    """The faults of one arm with their ticks."""
    kinds = tuple(KINDS.values())
    if entry is None:
        return []
    if isinstance(entry, kinds):
        return [(entry, 0)]
    if isinstance(entry, tuple) and len(entry) == 2 and isinstance(entry[0], kinds):
        try:
            tick = index(entry[1])
        except TypeError:
            tick = -1
        if tick < 0:
            raise InputError(
                f"the fault of arm {arm} is at tick {entry[1]!r:.40}, expected a whole number from 0"
            )
        return [(entry[0], tick)]
    if isinstance(entry, list):
        return [pair for one in entry for pair in _told(one, arm)]
    raise InputError(f"faults[{arm}] is {entry!r:.60}, expected {EXPECTED}")
