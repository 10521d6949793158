"""Recorded motions with torques: from a file, from the log of a run, or rehearsed by a simulated arm."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.model.fitting.exciting_motion import ExcitingMotion
from ftqp.model.fitting.torque_log import TorqueLog
from ftqp.model.robot import Robot
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.table_files import new_file
from ftqp.sim.number_files import TableFile
from ftqp.sim.plants.joint_servo import JointServo
from ftqp.sim.plants.true_arm import TrueArm

FEWEST = 1000
"""Samples before a failure that are looked at: of a second or so."""


def torque_log_of_csv(file: Path, joints: tuple[str, ...], late: float) -> TorqueLog:
    """The columns t [s], q.JOINT [rad or m] and tau.JOINT [N m or N] of a CSV file; others are left alone."""
    named = [f"{group}.{joint}" for group in ("q", "tau") for joint in joints]
    given = TableFile(file=file, what="log", sample="sample", valid=None, needed=("t",))
    table = given.csv_columns()
    strange = [name for name in table if name.partition(".")[0] in ("q", "tau") and name not in named]
    missing = [name for name in named if name not in table]
    if strange and missing:
        raise given.wrong(
            f" is of another arm: it has {strange[0]!r}, but no {missing[0]!r}; name its arm by --robot, and "
            "its columns after the joints"
        )
    if missing:
        raise given.wrong(f": column {missing[0]!r} is missing; it has {', '.join(table)}")
    q, tau = (np.stack([table[f"{group}.{joint}"] for joint in joints], axis=1) for group in ("q", "tau"))
    whole = np.isfinite(q).all(axis=1) & np.isfinite(tau).all(axis=1) & np.isfinite(table["t"])
    return TorqueLog(t=table["t"][whole], q=q[whole], tau=tau[whole], late=late, name=f"log {file}")


def torque_log_of_run(log: Log, joints: tuple[str, ...], latency: float) -> TorqueLog:
    """The healthy beginning of a run that kept its torques, measured or sent."""
    about, first = log.metadata, joints[0]
    its = tuple(about.get("joints", ()))
    if its != joints:
        raise InputError(f"{log.title} is of another arm: its joints are {', '.join(its)}")
    measured = f"tau_measured.{first}" in log
    if not measured and about.get("drive") != "torque":
        raise InputError(
            f"{log.title} keeps no torques of motors; record it with torque_noise in [sensors], or with a "
            "drive of kind 'torque' and plant 'mujoco'"
        )
    odd = ((log["truth"] != 0) | (log["belief"] != 0)).any(axis=1)
    count = int(np.argmax(odd)) if odd.any() else len(odd)
    if count < FEWEST:
        raise InputError(
            f"{log.title} is not healthy: a joint fails, or is believed to, at {log['t'][count]:g} s; record "
            "a run without faults and without a detector"
        )
    dt = float(about["dt"])
    q = log["q_measured" if f"q_measured.{first}" in log else "q"][:count]
    tau = log["tau_measured" if measured else "tau"][:count]
    late = -0.5 * dt if measured else latency + 0.5 * dt
    return TorqueLog(t=log["t"][:count], q=q, tau=tau, late=late, name=log.title)


def write_motion(file: Path, joints: tuple[str, ...], motion: ExcitingMotion) -> None:
    """The columns t, q.JOINT, v.JOINT, a.JOINT of a motion."""
    names = [f"{group}.{joint}" for group in ("q", "v", "a") for joint in joints]
    _write(file, names, motion.t, np.concatenate([motion.q, motion.v, motion.a], axis=1))


def write_torque_log(file: Path, joints: tuple[str, ...], log: TorqueLog) -> None:
    """The columns t, q.JOINT, tau.JOINT of a log."""
    names = [f"{group}.{joint}" for group in ("q", "tau") for joint in joints]
    _write(file, names, log.t, np.concatenate([log.q, log.tau], axis=1))


def _write(file: Path, names: list[str], t: FloatArray, values: FloatArray) -> None:
    """A table of numbers; nothing is overwritten."""
    with new_file(file) as part:
        np.savetxt(
            part, np.column_stack([t, values]), "%.9g", ",", header=",".join(["t", *names]), comments=""
        )


SUBSTEPS = 4
"""Servos take a command in each so many parts of a period: their torques would else be saw-teeth, and the
last tooth of a period is not their mean."""


def rehearsed(
    robot: Robot,
    motion: ExcitingMotion,
    true: TrueArm,
    *,
    bandwidth: float = 94.0,
    position_noise: float = 0.0,
    torque_noise: float = 0.0,
    seed: int = 0,
) -> TorqueLog:
    """What would be recorded of the true arm while its servos follow the motion."""
    from ftqp.sim.plants.mujoco_plant import MujocoPlant

    dt, rng, n = float(motion.t[1] - motion.t[0]), np.random.default_rng(seed), robot.nv
    servo = JointServo(true.geared(robot), "position", bandwidth=bandwidth)
    plant = MujocoPlant(robot, dt / SUBSTEPS, servo, true, substeps=1)
    plant.reset(motion.q[0], motion.v[0])
    q, tau, none = np.zeros_like(motion.q[:-1]), np.zeros_like(motion.q[:-1]), np.zeros(n, dtype=bool)
    for k in range(len(q)):
        q[k] = plant.q
        for part in range(SUBSTEPS):
            plant.advance(_between(motion, k, (part + 1) / SUBSTEPS, none))
            tau[k] += plant.tau / SUBSTEPS
    q += position_noise * rng.standard_normal(q.shape)
    tau += torque_noise * rng.standard_normal(q.shape)
    return TorqueLog(t=motion.t[:-1], q=q, tau=tau, late=0.5 * dt, name="the rehearsal")


def _between(motion: ExcitingMotion, k: int, share: float, none: FloatArray) -> SimpleNamespace:
    """The command at a share of the period after sample k."""
    q, v = (x[k] + share * (x[k + 1] - x[k]) for x in (motion.q, motion.v))
    return SimpleNamespace(q=q, v=v, tau=np.zeros(len(q)), brakes=none)
