"""From the steps of a run to the rows of its log: raw rows a tick, columns a block."""

from collections.abc import Sequence
from typing import final

import numpy as np

from ftqp.control.planner.planner import Planner
from ftqp.control.planner.step import Step
from ftqp.control.planner.step_parts import measures_of
from ftqp.core import clock
from ftqp.core.checks import FloatArray
from ftqp.faults.kinds import Fault, refuse_unknown
from ftqp.sim.further_measures import FurtherMeasures
from ftqp.sim.leader import Leader
from ftqp.sim.log.raw_rows import BLOCK, FELT, MEASURES, TASK_ROWS, RawLayout, table
from ftqp.sim.log.row_sink import RowSink
from ftqp.sim.log.signals import HEALTHY, PATH_CODES, QP_CODES
from ftqp.sim.plants.plant import Arm

UNMEASURED = (np.nan,) * len(MEASURES)
COMMIT_PERIOD = 250_000_000
"""Rows wait at most this long, and a tick, before they are handed on [ns of wall time]: a killed run may
lose half a second, and a loaded machine keeps a process waiting."""


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
        self._block = self._layout.block()
        self._first, self._filled = 0, 0
        self._handed_on = clock.now()
        self._truth = np.full(nv, float(HEALTHY))
        self._belief = self._truth.copy()
        self._faults: dict[str, Fault] = {}
        view = {name: self._block[:, place] for name, place in self._layout.fields.items()}
        self._joints = view["q"], view["v"], view["a"], view["tau"], view["tau_brake"]
        self._rest = view["lower"], view["upper"], view["belief"], view["truth"]
        self._target, self._tip = (self._layout.poses(self._block, name) for name in ("target", "tip"))
        self._t, self._velocity, self._slack = view["t"][:, 0], view["velocity"], view["slack"]
        self._jacobian = view["jacobian"].reshape(BLOCK, TASK_ROWS, nv)
        self._jacobian[:] = 0.0
        self._task_rows = TASK_ROWS
        first, last = (self._layout.fields[name] for name in (MEASURES[0], MEASURES[-1]))
        self._measures = slice(first.start, last.stop)
        self._scalars = self._block[:, self._layout.scalars]
        if world is not None:
            self._base_pose = self._layout.poses(self._block, "base_pose")
            self._eta, self._base_status = view["eta"], view["base_status"][:, 0]

        self._measured = view.get("further")
        self._sensed = tuple(view[name] for name in sensed)
        self._felt = tuple(name in sensed for name in FELT)

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
        """Keep one tick."""
        k, leader = self._filled, self._leader
        self._t[k] = t
        qs, vs, accelerations, torques, brakes = self._joints
        qs[k], vs[k] = q, v
        accelerations[k], torques[k], brakes[k] = step.a, step.tau, step.tau_brake
        lowers, uppers, beliefs, truths = self._rest
        lowers[k], uppers[k] = step.lower, step.upper
        beliefs[k], truths[k] = self._believed(), self._truth
        target = leader.target
        self._target[k], self._velocity[k] = target.pose[:3], target.twist[:3]
        world, standing = leader.world, leader.standing
        self._tip[k] = (self._arm.tip(q) if world is None else world.tip_pose)[:3]
        slack, qp = step.slack, step.qp
        if self._singularities:
            jacobian = step.jacobian
            self._task_rows = len(jacobian)
            self._jacobian[k, : self._task_rows] = jacobian
        self._slack[k] = 0.0
        self._slack[k, : len(slack)] = slack
        self._scalars[k] = (
            step.position_error,
            step.rotation_error,
            step.scale,
            step.code,
            QP_CODES[qp.status],
            qp.iterations,
            qp.residual,
            elapsed,
            step.kappa,
            *UNMEASURED,
            standing.progress,
            PATH_CODES[standing.status],
        )
        if self._sensed:
            values = [*(measured or (q, v)), step.q, step.v, *step.reference[:2]]
            values += [tau for tau, kept in zip(felt, self._felt, strict=True) if kept and tau is not None]
            for kept, value in zip(self._sensed, values, strict=True):
                kept[k] = value
        if world is not None:
            self._base_pose[k], self._eta[k] = world.base_pose[:3], world.eta
            self._base_status[k] = world.follower.code
        if self._measured is not None:
            self._measured[k] = self._further.at(q)
        self._filled = k + 1
        self._hand_on_in_time()

    @property
    def layout(self) -> RawLayout:
        """Where the fields of a raw row lie."""
        return self._layout

    @property
    def free(self) -> FloatArray:
        """The raw rows that come next, (K, width), 1 <= K <= 2048, to be filled and then kept by `keep`."""
        rows: FloatArray = self._block[self._filled :]
        return rows

    def keep(self, count: int, task_rows: int) -> None:
        """Keep the first rows of `free`; beliefs, truth and measures are filled in here."""
        rows = slice(self._filled, self._filled + count)
        _, _, beliefs, truths = self._rest
        beliefs[rows], truths[rows] = self._believed(), self._truth
        if self._measured is not None:
            self._measured[rows] = self._further.along(self._joints[0][rows])
        self._task_rows = task_rows
        self._filled += count
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
        jacobians = self._jacobian[: self._filled, : self._task_rows]
        working = np.count_nonzero(jacobians.any(axis=1), axis=1)
        with np.errstate(invalid="ignore"):
            measures = np.array(measures_of(jacobians, working))
        self._block[: self._filled, self._measures] = measures

    def _believed(self) -> FloatArray:
        """What the planner believes of each joint now."""
        faults = self._planner.faults
        if faults != self._faults:
            self._faults = dict(faults)
            self._belief[:] = HEALTHY
            for joint, fault in faults.items():
                self._belief[self._planner.robot.joint(joint)] = fault.number
        return self._belief
