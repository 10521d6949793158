"""From the steps of a run to the rows of its log: raw rows a tick, columns a block."""

from collections.abc import Callable, Sequence
from typing import Any, final

import numpy as np

from ftqp.control.planner.planner import Planner
from ftqp.control.planner.step import Step
from ftqp.control.planner.step_parts import measures_of
from ftqp.core import clock
from ftqp.core.checks import FloatArray
from ftqp.faults.kinds import Fault, refuse_unknown
from ftqp.sim.further_measures import FurtherMeasures
from ftqp.sim.leader import Leader
from ftqp.sim.log.log_rows import RowSink
from ftqp.sim.log.raw_rows import BLOCK, FELT, MEASURES, SENSED, TASK_ROWS, RawLayout, table
from ftqp.sim.log.signals import HEALTHY, PATH_CODES, Column, base_columns, columns, sensed_columns
from ftqp.sim.plants.plant import Arm

COMMIT_PERIOD = 250_000_000
"""Rows wait at most this long, and a tick, before they are handed on [ns of wall time]: a killed run may
lose half a second, and a loaded machine keeps a process waiting."""


def signals_of(planner: Planner, leader: Leader, sensed: Sequence[str]) -> tuple[Column, ...]:
    """The columns of what a recorder keeps."""
    robot, world = planner.robot, leader.world
    joints, slides = robot.joints, robot.chain.prismatic
    return (
        *columns(joints, slides, planner.level),
        *(() if world is None else base_columns(world.base.coordinates)),
        *sensed_columns(sensed, joints, slides),
        *FurtherMeasures(planner).columns,
    )


@final
class TickRecorder:
    """Keeps the raw row of every tick, and hands the columns on after 0.25 s or 2048 rows."""

    def __init__(
        self,
        sink: RowSink,
        planner: Planner,
        leader: Leader,
        *,
        sensed: Sequence[str] = (),
        singularities: bool = True,
    ) -> None:
        self._singularities = singularities
        self._sink, self._planner, self._leader = sink, planner, leader
        self._arm = Arm(planner.robot)
        world = leader.world
        nv = planner.robot.nv
        self._further = FurtherMeasures(planner)
        self._layout = RawLayout(
            nv,
            None if world is None else len(world.base.coordinates),
            sensed=sensed,
            further=len(self._further),
        )
        self._block, fields = self._layout.block(), self._layout.fields
        self._keep: Callable[[int, int], int] | None = None
        self._before, self._between, self._timed, self._behind = (
            self._block[:, fields[first].start : fields[last].stop]
            for first, last in (
                ("t", "v"),
                ("belief", "tip"),
                ("step_time", "step_time"),
                ("progress", "path_status"),
            )
        )
        self._others = self._block[:, fields["path_status"].stop :]
        self._jacobian = self._block[:, fields["jacobian"]].reshape(BLOCK, TASK_ROWS, nv)
        self._measures = self._block[:, fields[MEASURES[0]].start : fields[MEASURES[-1]].stop]
        self._first, self._filled = 0, 0
        self._handed_on = clock.now()
        self._truth = np.full(nv, float(HEALTHY))
        self._belief = self._truth.copy()
        self._faults: dict[str, Fault] = {}
        self._sensed = [(*SENSED, *FELT).index(name) for name in sensed]
        self._unknown = np.full(nv, np.nan)

    def fail(self, fault: Fault) -> None:
        """From this row on the joint has really failed."""
        refuse_unknown(fault)
        self._truth[self._planner.robot.joint(fault.joint)] = fault.number

    def repair(self, joint: str | int) -> None:
        """From this row on the joint really works again."""
        self._truth[self._planner.robot.joint(joint)] = HEALTHY

    def write(
        self,
        t: float,
        q: FloatArray,
        v: FloatArray,
        step: Step,
        elapsed: int,
        measured: tuple[FloatArray, FloatArray] | None = None,
        felt: tuple[FloatArray | None, FloatArray | None] = (None, None),
    ) -> None:
        """Keep one tick: its raw row, field by field in their order."""
        leader, k, fields = self._leader, self._filled, self._layout.fields
        world, standing, target = leader.world, leader.standing, leader.target
        tip = self._arm.tip(q) if world is None else world.tip_pose
        if self._keep is None:
            self._keep = step.keeper(self._block, fields["a"].start, fields["slack"].start)
        self._keep(k, step.code)
        self._before[k] = np.concatenate(((t,), q, v))
        between = self._believed(), self._truth, target.pose[:3], target.twist[:3], tip[:3]
        self._between[k] = np.concatenate(between, axis=None)
        self._timed[k] = elapsed
        self._behind[k] = standing.progress, PATH_CODES[standing.status]
        row: list[Any] = []
        if world is not None:
            row += [world.base_pose[:3], world.eta, (world.follower.code,)]
        if self._sensed:
            seen = (*(measured or (q, v)), step.q, step.v, *step.reference[:2], *felt)
            row += [self._unknown if (one := seen[place]) is None else one for place in self._sensed]
        if len(self._further):
            row.append(self._further.at(q))
        if row:
            self._others[k] = np.concatenate(row, axis=None)
        self._filled += 1
        self._hand_on_in_time()

    def _hand_on_in_time(self) -> None:
        if self._filled == BLOCK or clock.now() - self._handed_on > COMMIT_PERIOD:
            self.flush()

    def flush(self) -> None:
        """Hand all rows on. Interrupted at any point, it can be called again."""
        if self._filled:
            if self._singularities:
                self._measure()
            self._sink.write(self._first, table(self._block[: self._filled], self._layout))
        self._first, self._filled = self._first + self._filled, 0
        self._handed_on = clock.now()

    def _measure(self) -> None:
        """Fill in the measures of singularity of all rows at once, from their Jacobians."""
        jacobians = self._jacobian[: self._filled, : len(self._planner.task_rows)]
        working = np.count_nonzero(jacobians.any(axis=1), axis=1)
        with np.errstate(invalid="ignore"):
            measures = np.array(measures_of(jacobians, working))
        self._measures[: self._filled] = measures

    def _believed(self) -> FloatArray:
        """What the planner believes of each joint now."""
        faults = self._planner.faults
        if faults != self._faults:
            self._faults = dict(faults)
            self._belief[:] = HEALTHY
            for joint, fault in faults.items():
                self._belief[self._planner.robot.joint(joint)] = fault.number
        return self._belief
