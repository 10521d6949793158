"""Arms in physics for the study of detection: fast, from a seed, copied at an instant to fail in many ways.

A healthy motion is simulated once. At some of its ticks everything is kept (planner, physics, what is under
way in the sensors), and from there the arm goes on again and again, each time with another fault.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from math import pi
from typing import Any

import mujoco
import numpy as np

import ftqp
from ftqp.model.chain import chain_of
from ftqp.sim.plants.plant import Arm
from ftqp.sim.sensors.joint_sensors import Reading, SensorFault

DT = 1e-3
NO_DICE = np.random.default_rng(0)
"""No fault that is tried here throws dice."""
SUBSTEPS = 2
"""Time steps of the physics in a tick: 2 kHz."""
DRIVES = {
    "position 15 Hz": ("position", 15.0),
    "position 60 Hz": ("position", 60.0),
    "velocity": ("velocity", 15.0),
    "torque": ("torque", 0.0),
}
"""What the arm takes, and the bandwidth of its servos [Hz]."""
SETTINGS = ("nominal", "real", "quantised")
ROBOTS = ("panda", "iiwa14")
SIGMA_Q, SIGMA_TAU = 1e-4, 0.3
"""Noise of encoders [rad] and of torque sensors [N m]."""
QUANTUM = 1e-4
"""Step of quantised encoders [rad], which have no noise beside it."""
PAYLOAD, FRICTION, LATENCY = 0.5, 0.5, 2
"""What is real and unknown: load [kg], dry friction [N m], ticks of delay."""
WRISTS = 3
"""The last joints have a third of that friction."""
ROTORS = {"iiwa14": 0.1}
"""Rotor inertia [kg m2] of arms whose catalog entry has none: stated as for xarm7, not identified. Without it
a runaway last joint of the iiwa14, 0.001 kg m2 behind 40 N m, would be 40 rad/s fast after a tick."""
SIGNALS = ("q", "tau", "demand", "tau_c", "q_r", "v_r", "a_r")
"""What is kept of a tick: measured positions, torques, demands; torques sent; the reference at its end."""
STATE = mujoco.mjtState.mjSTATE_INTEGRATION
Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True)
class Configuration:
    """One arm, what it takes, and how real it is."""

    robot: str
    drive: str
    setting: str

    @property
    def latency(self) -> int:
        """Ticks by which everything is measured late."""
        return LATENCY if self.setting == "real" else 0

    @property
    def quantum(self) -> float:
        """Step of the encoders [rad]; 0 is none."""
        return QUANTUM if self.setting == "quantised" else 0.0

    @property
    def has_servo(self) -> bool:
        """Whether joint servos stand between the command and the motors."""
        return self.drive != "torque"

    def made_drive(self) -> ftqp.Drive:
        """The drive as the planner is told of it."""
        kind, hertz = DRIVES[self.drive]
        servo = {"bandwidth": 2.0 * pi * hertz} if hertz else {}
        return ftqp.Drive(kind=kind, latency=self.latency * DT, **servo)

    def noise(self) -> ftqp.Noise:
        """The noise as planner and detector are told of it."""
        return ftqp.Noise(q=QUANTUM if self.quantum else SIGMA_Q, tau=SIGMA_TAU)

    def __str__(self) -> str:
        return f"{self.robot}, {self.drive}, {self.setting}"


CONFIGURATIONS = tuple(
    Configuration(robot, drive, setting)
    for settings in (SETTINGS[:2], SETTINGS[2:])
    for robot in ROBOTS
    for drive in DRIVES
    for setting in settings
)


@dataclass(slots=True)
class Record:
    """What happened, tick by tick.

    Attributes:
        seen: what a detector may know, (K, 7, nv), see `SIGNALS`.
        truth: true positions, motor torques and demands at the start of each tick, (K, 3, nv).
        codes: status of each step, (K,).
    """

    seen: Array
    truth: Array
    codes: Array

    def __getattr__(self, name: str) -> Array:
        return self.seen[:, SIGNALS.index(name)]

    def part(self, first: int, end: int) -> "Record":
        """The ticks from ``first`` on and before ``end``."""
        return Record(self.seen[first:end], self.truth[first:end], self.codes[first:end])

    def copy(self) -> "Record":
        """A record of its own."""
        return Record(self.seen.copy(), self.truth.copy(), self.codes.copy())


def empty(ticks: int, nv: int) -> Record:
    """A record to be filled."""
    return Record(
        np.zeros((ticks, len(SIGNALS), nv)), np.zeros((ticks, 3, nv)), np.zeros(ticks, dtype=np.int8)
    )


Event = Callable[["World"], SensorFault | None]
"""What happens at an instant: done to the arm, or given back as what its encoder does from then on."""


class World:
    """One configuration, ready to be led along many motions.

    Args:
        configuration: which.
        payload: the load nobody knows of [kg]; None is that of the setting.
        friction: dry friction [N m]; None is that of the setting.
    """

    def __init__(
        self, configuration: Configuration, payload: float | None = None, friction: float | None = None
    ) -> None:
        self.configuration = configuration
        self.robot = robot = arm(configuration.robot)
        kind, hertz = DRIVES[configuration.drive]
        real = configuration.setting == "real"
        load = (PAYLOAD if real else 0.0) if payload is None else payload
        dry = (FRICTION if real else 0.0) if friction is None else friction
        share = np.where(np.arange(robot.nv) < robot.nv - WRISTS, dry, dry / 3.0)
        true = ftqp.TrueArm(
            payload=ftqp.Payload(load) if load else None,
            coulomb=dict(zip(robot.joints, share.tolist(), strict=True)),
        )
        servo = {"bandwidth": 2.0 * pi * hertz} if hertz else {}
        self.plant = ftqp.MujocoPlant(
            robot, DT, ftqp.JointServo(robot, kind, **servo), true, substeps=SUBSTEPS
        )
        self.planner = planner(configuration)
        self.arm = Arm(robot)
        self._model, self._data = self.plant._physics._model, self.plant._physics._data
        self._memory = self.planner._session._memory.view(np.uint8)
        self._size = mujoco.mj_stateSize(self._model, STATE)
        self._noise = np.zeros((2, 0, robot.nv))

    def begin(self, q: Array, ticks: int, generator: np.random.Generator) -> Record:
        """Stand at q, with new noise for so many ticks: the record to be filled."""
        self.plant.reset(q, np.zeros(self.robot.nv))
        self.planner.reset(q)
        self._noise = generator.standard_normal((2, ticks, self.robot.nv))
        self._noise[0] *= 0.0 if self.configuration.quantum else SIGMA_Q
        self._noise[1] *= SIGMA_TAU
        return empty(ticks, self.robot.nv)

    def keep(self) -> tuple[Array, Array, Array]:
        """All that the next tick depends on, beside the record."""
        state = np.empty(self._size)
        mujoco.mj_getState(self._model, self._data, state, STATE)
        return self._memory.copy(), state, self.plant.demand.copy()

    def restore(self, kept: tuple[Array, Array, Array]) -> None:
        """Be again as ``kept`` says, healthy."""
        memory, state, demand = kept
        self.plant.reset(self.robot.neutral, np.zeros(self.robot.nv))
        self._memory[:] = memory
        mujoco.mj_setState(self._model, self._data, state, STATE)
        self.plant._servo.demand[:] = demand

    def run(
        self, record: Record, targets: ftqp.Targets, first: int, end: int, fault: SensorFault | None = None,
        joint: int = 0, since: int = 0, kept: dict[int, Any] | None = None,
    ) -> None:  # fmt: skip
        """The ticks from ``first`` on and before ``end``; those that are keys of ``kept`` are kept there."""
        planner, plant, late = self.planner, self.plant, self.configuration.latency
        quantum = self.configuration.quantum
        seen, truth, codes, (noise_q, noise_tau) = record.seen, record.truth, record.codes, self._noise
        q, tau, demand = plant.q, plant.tau, plant.demand
        torques = not self.configuration.has_servo
        for k in range(first, end):
            if kept is not None and k in kept:
                kept[k] = self.keep()
            now, row = truth[k], seen[k]
            now[0], now[1], now[2] = q, tau, demand
            past, measured = truth[k - late if k > late else 0], row[0]
            np.add(past[0], noise_q[k], out=measured)
            if quantum:
                measured[:] = quantum * np.round(measured / quantum)
            np.add(past[1], noise_tau[k], out=row[1])
            row[2] = past[2]
            if fault is not None and k - late >= since:
                zero = np.zeros_like(measured)
                reading = Reading(measured, zero, seen[k - 1, 0], zero.copy(), k - late - since, DT, NO_DICE)
                fault.spoil(reading, slice(joint, joint + 1))
            step = planner.step(measured, None, targets.at(k))
            if torques:
                row[3] = step.tau
            row[4], row[5], row[6] = step.reference
            codes[k] = step.code
            plant.advance(step)


@cache
def arm(name: str) -> ftqp.Robot:
    """The arm of that name, with rotors."""
    robot = ftqp.robots.load(name)
    if name not in ROTORS:
        return robot
    model = robot.model.copy()
    model.armature = np.full(robot.nv, ROTORS[name])
    return replace(robot, model=model, chain=chain_of(model, robot.tip))


def planner(configuration: Configuration) -> ftqp.Planner:
    """The planner of a configuration, which is never told of anything."""
    return ftqp.Planner(
        arm(configuration.robot),
        DT,
        drive=configuration.made_drive(),
        noise=configuration.noise(),
    )


@cache
def world(configuration: Configuration, payload: float | None = None, friction: float | None = None) -> World:
    """The world of a configuration, made once in a process."""
    return World(configuration, payload, friction)
