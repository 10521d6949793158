"""The arm as it is fitted, with load and tool: what its motors can hold and brake."""

import logging
from typing import Any, final
from weakref import WeakKeyDictionary

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.pose import pose
from ftqp.kernel.entry.planner_commands import NO_LOAD, Load, ReserveSamples
from ftqp.kernel.layout.thresholds import LENGTH_FRACTION, REACHES
from ftqp.model.followers import coupled_columns, coupled_places
from ftqp.model.payload import Payload
from ftqp.model.posture import gravity_torques
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")
SAMPLES = 400
"""Random configurations that are looked at."""
SPEED_SHARE = 0.5
"""Velocities are sampled up to this share of the limits."""
SEED = 20170511
"""Of the samples: so that an arm always has the same reserve."""


@final
class MountedRobot:
    """A bare robot with its load and, at ``place`` in its tip's frame, (4, 4), its tool; it never changes."""

    __slots__ = ("bare", "load", "payload", "place", "robot")

    def __init__(self, bare: Robot, payload: Payload | None = None, place: FloatArray | None = None) -> None:
        self.bare, self.place, self.payload = bare, place, payload
        robot = bare if payload is None else bare.with_payload(payload)
        self.robot = robot if place is None else robot.with_tip(place, f"{robot.tip} tool")
        self.load = NO_LOAD if payload is None else Load(payload.mass, payload.com, payload.inertia)

    def carrying(self, payload: Payload | None) -> "MountedRobot":
        """The robot with another load."""
        changed = MountedRobot(self.bare, payload, self.place)
        of = "the centre of mass of the load is {} m from the end effector,"
        if payload is not None and (said := in_millimetres(self.bare, payload.com, of)):
            _LOG.warning("%s: %s", self.bare.name, said)
        return changed

    def holding(self, T: Any) -> "MountedRobot":
        """The robot with another controlled point, (4, 4) in the frame of the bare robot's tip."""
        place = None if T is None else pose(T, "T")
        if place is not None and (
            said := in_millimetres(self.bare, place[:3, 3], "the tool is {} m long, at the end")
        ):
            _LOG.warning("%s: %s", self.bare.name, said)
        return self if place is self.place else MountedRobot(self.bare, self.payload, place)


_RESERVES: WeakKeyDictionary[Robot, ReserveSamples] = WeakKeyDictionary()


def braking_reserve(robot: Robot, load: Load | None = None) -> ReserveSamples:
    """Samples of what braking takes; without a load taken once and shared by all planners of the robot.

    If every joint brakes with kappa a_max, whatever the directions, joint i needs at most
    |h_i| + kappa sum_j |M_ij| a_max_j. The shares of the samples are the largest kappa that all torque limits
    allow on all of them: sound up to the sampling.
    """
    if load is None and robot in _RESERVES:
        return _RESERVES[robot]
    n, limits = robot.nv, robot.limits
    generator = np.random.default_rng(SEED)
    low = np.where(np.isfinite(limits.q_min), limits.q_min, -np.pi)
    high = np.where(np.isfinite(limits.q_max), limits.q_max, np.pi)
    v_max = np.minimum(limits.v_max, 10.0) * SPEED_SHARE
    q, v = np.empty((SAMPLES, n)), np.empty((SAMPLES, n))
    for k in range(SAMPLES):
        q[k], v[k] = generator.uniform(low, high), generator.uniform(-v_max, v_max)
    if robot.chain.has_followers:
        v = coupled_places(robot.chain, v) - coupled_places(robot.chain, np.zeros(n))
        q = coupled_places(robot.chain, q)
    samples = ReserveSamples(robot.chain.constants(), q, v, load)
    if load is None:
        _RESERVES[robot] = samples
    return samples


def weight_sentence(robot: Robot, q: FloatArray, tau_max: FloatArray) -> str:
    """What is to be said where a motor cannot hold the arm at rest at q; empty where all can."""
    holding = gravity_torques(robot.model, robot.model.createData(), robot.configuration(q))
    tau = np.abs(coupled_columns(robot.chain, holding))
    worst = int(np.argmax(tau / tau_max))
    if not tau[worst] > tau_max[worst]:
        return ""
    return (
        f"{robot.joints[worst]} needs {tau[worst]:.3g} N m to hold the arm still here, beyond its limit of "
        f"{tau_max[worst]:.3g} N m, so the arm may sink; choose another posture, or correct the payload, the "
        "masses or robot.with_limits(tau_max=...)"
    )


def in_millimetres(robot: Robot, place: FloatArray, what: str = "the target is {} m from the base") -> str:
    """What is to be said of a place that is so far away that it must be in millimetres; empty of others."""
    endless = robot.chain.prismatic & ~(np.isfinite(robot.limits.q_min) & np.isfinite(robot.limits.q_max))
    reach, away = robot.length / LENGTH_FRACTION, float(np.linalg.norm(place))
    if robot.chain.floating or endless.any() or not away > REACHES * reach:
        return ""
    return (
        f"{what.format(f'{away:.4g}')} of an arm that reaches {reach:.2g} m; lengths are in m, "
        "and this looks like millimetres: multiply it by 0.001"
    )


def out_of_reach(robot: Robot, place: FloatArray) -> str:
    """What is to be said of a place that no posture brings the tip to, by lengths alone; empty of others."""
    chain, limits = robot.chain, robot.limits
    way = chain.way(chain.tip_joint)
    if chain.floating or not way:
        return ""
    slides = [i for i in way if chain.prismatic[i]]
    steps = np.vstack([chain.translation[way[1:]], chain.tip_translation])
    most = float(np.linalg.norm(steps, axis=1).sum()) + float(
        np.maximum(np.abs(limits.q_min), np.abs(limits.q_max))[slides].sum()
    )
    away = float(np.linalg.norm(place - chain.translation[way[0]]))
    if not away > most:
        return ""
    return f"the pose is {away:.3g} m from {chain.names[way[0]]}, and the arm is {most:.3g} m long, stretched"


def warn_of_weight(robot: Robot, q: FloatArray | None, tau_max: FloatArray) -> None:
    """One warning on the logger ``ftqp`` where a motor cannot hold the arm at rest at q, or at neutral."""
    if sentence := weight_sentence(robot, robot.neutral if q is None else q, tau_max):
        _LOG.warning("%s: %s", robot.name, sentence)


def warn_of_rotors(robot: Robot) -> None:
    """One warning on the logger ``ftqp`` where torques go to joints whose rotors the model lacks."""
    without = [joint for joint, rotor in zip(robot.joints, robot.chain.armature, strict=True) if not rotor]
    if without:
        _LOG.warning(
            "%s: no rotor inertia%s is in the model, and behind a gear it can be most of what a joint "
            "accelerates; it is estimated while the arm moves, and better known from the start: give it by "
            "robot.with_rotors(...), armature in MJCF, or drake:rotor_inertia and drake:gear_ratio in URDF",
            robot.name,
            f" of {', '.join(without)}" if len(without) < robot.nv else "",
        )
