"""An arm with all that leads it: planner, leader, plant and sensors, one tick at a time."""

from typing import Generic, NamedTuple, TypeVar, final

from ftqp.control.planner.planner import Planner
from ftqp.control.planner.step import Step
from ftqp.core import clock
from ftqp.core.checks import FloatArray
from ftqp.sim.leader import Leader
from ftqp.sim.log.raw_rows import FELT, SENSED
from ftqp.sim.log.tick_recorder import TickRecorder
from ftqp.sim.plants.plant import Plant
from ftqp.sim.sensors.joint_sensors import JointSensors

LeaderT = TypeVar("LeaderT", bound=Leader)


class Made(NamedTuple):
    """One tick before the arm moves on."""

    step: Step  # the planner's step
    elapsed: int  # wall time of the step [ns]
    measured: tuple[FloatArray, FloatArray]  # positions and velocities that the planner was given, each (nv,)
    # torques that it was given, and those that the drives asked for, as far as they are known
    felt: tuple[FloatArray | None, FloatArray | None]


@final
class LedArm(Generic[LeaderT]):
    """Target, sensors and step in the order in which they happen; simulations and sessions use it."""

    def __init__(
        self, planner: Planner, leader: LeaderT, plant: Plant, sensors: JointSensors | None = None
    ) -> None:
        self.planner, self.leader, self.plant, self.sensors = planner, leader, plant, sensors

    @property
    def sensed(self) -> tuple[str, ...]:
        """What a log keeps where what is sent, what is measured and what is true may be three."""
        plant, sensors = self.plant, self.sensors
        if sensors is None and plant.drive is None:
            return ()
        feels = sensors is not None and sensors.feels_torque
        known = feels, plant.motors is not None and plant.drive != "torque"
        return (*SENSED, *(name for name, is_known in zip(FELT, known, strict=True) if is_known))

    def reset(self, q: FloatArray, v: FloatArray, ticks: int) -> None:
        """Begin a run of at most so many ticks with a healthy arm at (q, v), each (nv,)."""
        self.leader.reset(q, v, ticks)
        self.plant.reset(q, v)
        if self.sensors is not None:
            self.sensors.reset()

    def think(self, k: int) -> Made:
        """Take aim, measure, and let the planner step; the arm stays where it is until ``plant.advance``."""
        leader, plant, sensors = self.leader, self.plant, self.sensors
        leader.aim(k, plant.q)
        q, v, motors = plant.q, plant.v, plant.motors
        tau, demand = None, None if motors is None else motors.demand
        if sensors is not None:
            sensors.measure(q, v, motors)
            q, v, tau, demand = sensors.q, sensors.v, sensors.tau, sensors.demand
        before = clock.now()
        step = leader.step(q, v, tau)
        elapsed = clock.now() - before
        return Made(step, elapsed, (q, v), (tau, demand))

    def write(self, recorder: TickRecorder, t: float, made: Made) -> None:
        """Keep the row of a tick."""
        plant = self.plant
        recorder.write(t, plant.q, plant.v, made.step, made.elapsed, made.measured, made.felt)
