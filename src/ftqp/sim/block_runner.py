"""Runs of ticks in compiled code, where nothing but the planner and an arm that obeys takes part."""

from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.control.planner.planner import Planner
from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.faults.kinds import FreeSwinging
from ftqp.sim.leader import ClockLeader, Leader
from ftqp.sim.log.raw_rows import BLOCK, RawLayout
from ftqp.sim.log.signals import PATH_CODES
from ftqp.sim.log.tick_recorder import TickRecorder
from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.plants.plant import Plant

_NONE: IntArray = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class _Ended:
    """Where a block left the arm, each (nv,); that arm has neither motors nor brakes."""

    q: FloatArray
    v: FloatArray
    tau: FloatArray
    brakes: BoolArray


@final
class BlockRunner:
    """Makes many ticks at once, with the same commands and the same rows as one by one."""

    def __init__(
        self,
        planner: Planner,
        leader: Leader,
        plant: Plant,
        recorder: TickRecorder | None,
        *,
        measured: bool = False,
    ) -> None:
        self._planner, self._plant, self._recorder = planner, plant, recorder
        self._leader = leader if isinstance(leader, ClockLeader) and leader.world is None else None
        # A planner of another class may do something in every step.
        possible = type(planner) is Planner and self._leader is not None and isinstance(plant, KinematicPlant)
        possible = possible and not measured
        self._blocks = planner.blocks() if possible else None
        self._torques = np.full(planner.robot.nv, np.nan)
        self._brakes = np.zeros(planner.robot.nv, dtype=np.bool_)
        layout = RawLayout(planner.robot.nv) if recorder is None else recorder.layout
        self._fields, self._places = layout.fields, layout.places()
        self._rows = len(planner.task_rows) if possible else 0
        self._scratch = np.empty((BLOCK, layout.width)) if recorder is None and self._blocks else None

    def run(self, k: int, end: int) -> IntArray:
        """Codes of the statuses of the ticks made, from k on and before ``end``; none where a loop has to."""
        leader, blocks, plant, recorder = self._leader, self._blocks, self._plant, self._recorder
        none = _NONE
        if leader is None or blocks is None or not isinstance(plant, KinematicPlant):
            return none
        believed = self._planner.faults
        if not plant.obeys(believed) or any(isinstance(f, FreeSwinging) for f in believed.values()):
            return none
        rows = recorder.free if recorder is not None else self._scratch
        assert rows is not None
        targets, times = leader.targets.packed(k, min(end - k, len(rows)))
        done = blocks.run(plant.q, plant.v, targets, rows, self._places)
        if done == 0:
            return none
        kept, f = rows[:done], self._fields
        kept[:, f["t"]] = (np.arange(k, k + done) * self._planner.dt)[:, None]
        kept[:, f["target"]], kept[:, f["velocity"]] = targets[:done, :12], targets[:done, 16:19]
        kept[:, f["progress"]] = times[:done, None]
        kept[:, f["path_status"]] = PATH_CODES[None]
        codes: IntArray = kept[:, f["status"]][:, 0].astype(np.int64)
        plant.advance(_Ended(blocks.q, blocks.v, self._torques, self._brakes))
        leader.aim(k + done - 1, plant.q)
        if recorder is not None:
            recorder.keep(done, self._rows)
        return codes
