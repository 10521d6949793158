"""ftqp: an arm keeps its task through a joint failure.

Names are loaded when they are first used: ``import ftqp`` loads numpy only; pinocchio comes with the first
robot.
"""

import sys

# Python puts the current folder on the path for ``python -m ftqp``, and a stranger's numpy.py may lie in it.
if (
    sys.argv[:1] == ["-m"]
    and sys.orig_argv[-len(sys.argv)].removeprefix("-m").partition(".")[0] == "ftqp"
    and not (sys.flags.safe_path or sys.path[0] == __file__.rpartition("ftqp")[0][:-1])
):
    del sys.path[0]

from importlib import import_module
from typing import TYPE_CHECKING, Any

from ftqp.core.errors import FtqpError, InputError, MissingPackage, ModelError, ScenarioError

if TYPE_CHECKING:
    from ftqp import analysis as analysis
    from ftqp import qp as qp
    from ftqp.app.scenario.setup import load as load_scenario  # noqa: F401  its home has another name
    from ftqp.control import batch as batch
    from ftqp.control import paths as paths
    from ftqp.control.drive.computed_torque import ComputedTorque as ComputedTorque
    from ftqp.control.drive.identification import ServoLag as ServoLag
    from ftqp.control.drive.identification import servo_lag as servo_lag
    from ftqp.control.drive.joint_drive import Drive as Drive
    from ftqp.control.drive.noise import Noise as Noise
    from ftqp.control.following.goto import GoTo as GoTo
    from ftqp.control.following.goto import GoToStatus as GoToStatus
    from ftqp.control.following.path_follower import PathFollower as PathFollower
    from ftqp.control.following.path_follower import PathStatus as PathStatus
    from ftqp.control.following.stall import StallEscape as StallEscape
    from ftqp.control.following.target_follower import TargetFollower as TargetFollower
    from ftqp.control.following.target_follower import TargetStatus as TargetStatus
    from ftqp.control.moving_base.base_gain import Observer as Observer
    from ftqp.control.moving_base.base_gain import best_gain as best_gain
    from ftqp.control.moving_base.base_gain import gain_limit as gain_limit
    from ftqp.control.moving_base.base_gain import sensitivity as sensitivity
    from ftqp.control.moving_base.inertial_task import BaseStatus as BaseStatus
    from ftqp.control.moving_base.inertial_task import InertialTask as InertialTask
    from ftqp.control.moving_base.inertial_task import MovingBase as MovingBase
    from ftqp.control.planner.certificate import Certificate as Certificate
    from ftqp.control.planner.planner import Planner as Planner
    from ftqp.control.planner.status import StepStatus as StepStatus
    from ftqp.control.planner.step import Step as Step
    from ftqp.control.planner.target import Target as Target
    from ftqp.control.planner.target import Targets as Targets
    from ftqp.control.rates import approximate_pinv as approximate_pinv
    from ftqp.control.rates import damping_factor as damping_factor
    from ftqp.control.rates import resolve_rates as resolve_rates
    from ftqp.control.references.tip_limits import TipLimits as TipLimits
    from ftqp.control.task import bounds as bounds
    from ftqp.control.task import schemes as schemes
    from ftqp.control.task.bounds import Jin as Jin
    from ftqp.control.task.bounds import OneStep as OneStep
    from ftqp.control.task.bounds import Viability as Viability
    from ftqp.control.task.directional_damping import DirectionalDamping as DirectionalDamping
    from ftqp.control.task.emergency import EmergencyStop as EmergencyStop
    from ftqp.control.task.resolvers import Damping as Damping
    from ftqp.control.task.scheme import Scheme as Scheme
    from ftqp.control.task.task import Task as Task
    from ftqp.faults.detection.calibration import Calibration as Calibration
    from ftqp.faults.detection.detector import Detector as Detector
    from ftqp.faults.detection.diagnosis import Diagnosis as Diagnosis
    from ftqp.faults.detection.motion_log import Commanded as Commanded
    from ftqp.faults.detection.motion_log import MotionLog as MotionLog
    from ftqp.faults.kinds import Degraded as Degraded
    from ftqp.faults.kinds import FreeSwinging as FreeSwinging
    from ftqp.faults.kinds import Locked as Locked
    from ftqp.kernel.layout.criteria import Criterion as Criterion
    from ftqp.model import catalog as robots  # noqa: F401  its home has another name
    from ftqp.model.limits import JointLimits as JointLimits
    from ftqp.model.payload import Payload as Payload
    from ftqp.model.robot import Robot as Robot
    from ftqp.qp.adapters.backend import Backend as Backend
    from ftqp.qp.problem import QP as QP
    from ftqp.sim.log.log_file import load_log as load_log
    from ftqp.sim.loop import Simulation as Simulation
    from ftqp.sim.plants.joint_servo import JointServo as JointServo
    from ftqp.sim.plants.kinematic_plant import KinematicPlant as KinematicPlant
    from ftqp.sim.plants.mujoco_plant import MujocoPlant as MujocoPlant
    from ftqp.sim.plants.plant import Plant as Plant
    from ftqp.sim.plants.true_arm import TrueArm as TrueArm
    from ftqp.sim.schedule import FaultEvent as FaultEvent
    from ftqp.sim.schedule import Schedule as Schedule
    from ftqp.sim.sensors.joint_sensors import JointSensors as JointSensors

__version__ = "0.1.0"

_HOME = {
    "Backend": "ftqp.qp.adapters.backend",
    "BaseStatus": "ftqp.control.moving_base.inertial_task",
    "Calibration": "ftqp.faults.detection.calibration",
    "Certificate": "ftqp.control.planner.certificate",
    "Commanded": "ftqp.faults.detection.motion_log",
    "ComputedTorque": "ftqp.control.drive.computed_torque",
    "Criterion": "ftqp.kernel.layout.criteria",
    "Damping": "ftqp.control.task.resolvers",
    "Degraded": "ftqp.faults.kinds",
    "Detector": "ftqp.faults.detection.detector",
    "Diagnosis": "ftqp.faults.detection.diagnosis",
    "Drive": "ftqp.control.drive.joint_drive",
    "DirectionalDamping": "ftqp.control.task.directional_damping",
    "EmergencyStop": "ftqp.control.task.emergency",
    "FaultEvent": "ftqp.sim.schedule",
    "FreeSwinging": "ftqp.faults.kinds",
    "GoTo": "ftqp.control.following.goto",
    "GoToStatus": "ftqp.control.following.goto",
    "InertialTask": "ftqp.control.moving_base.inertial_task",
    "Jin": "ftqp.control.task.bounds",
    "JointLimits": "ftqp.model.limits",
    "JointSensors": "ftqp.sim.sensors.joint_sensors",
    "JointServo": "ftqp.sim.plants.joint_servo",
    "KinematicPlant": "ftqp.sim.plants.kinematic_plant",
    "Locked": "ftqp.faults.kinds",
    "Noise": "ftqp.control.drive.noise",
    "OneStep": "ftqp.control.task.bounds",
    "MotionLog": "ftqp.faults.detection.motion_log",
    "MovingBase": "ftqp.control.moving_base.inertial_task",
    "MujocoPlant": "ftqp.sim.plants.mujoco_plant",
    "Observer": "ftqp.control.moving_base.base_gain",
    "PathFollower": "ftqp.control.following.path_follower",
    "PathStatus": "ftqp.control.following.path_follower",
    "Payload": "ftqp.model.payload",
    "Plant": "ftqp.sim.plants.plant",
    "Planner": "ftqp.control.planner.planner",
    "QP": "ftqp.qp.problem",
    "Robot": "ftqp.model.robot",
    "Schedule": "ftqp.sim.schedule",
    "Scheme": "ftqp.control.task.scheme",
    "ServoLag": "ftqp.control.drive.identification",
    "Simulation": "ftqp.sim.loop",
    "StallEscape": "ftqp.control.following.stall",
    "Step": "ftqp.control.planner.step",
    "StepStatus": "ftqp.control.planner.status",
    "TrueArm": "ftqp.sim.plants.true_arm",
    "Target": "ftqp.control.planner.target",
    "TargetFollower": "ftqp.control.following.target_follower",
    "TargetStatus": "ftqp.control.following.target_follower",
    "Targets": "ftqp.control.planner.target",
    "Task": "ftqp.control.task.task",
    "TipLimits": "ftqp.control.references.tip_limits",
    "Viability": "ftqp.control.task.bounds",
    "approximate_pinv": "ftqp.control.rates",
    "best_gain": "ftqp.control.moving_base.base_gain",
    "damping_factor": "ftqp.control.rates",
    "gain_limit": "ftqp.control.moving_base.base_gain",
    "load_log": "ftqp.sim.log.log_file",
    "load_scenario": "ftqp.app.scenario.setup:load",
    "resolve_rates": "ftqp.control.rates",
    "sensitivity": "ftqp.control.moving_base.base_gain",
    "servo_lag": "ftqp.control.drive.identification",
}
_MODULES = {
    "analysis": "ftqp.analysis",
    "batch": "ftqp.control.batch",
    "bounds": "ftqp.control.task.bounds",
    "paths": "ftqp.control.paths",
    "qp": "ftqp.qp",
    "robots": "ftqp.model.catalog",
    "schemes": "ftqp.control.task.schemes",
}

__all__ = [
    "FtqpError",
    "InputError",
    "MissingPackage",
    "ModelError",
    "ScenarioError",
    "__version__",
    *_HOME,
    *_MODULES,
]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        module, _, attribute = _HOME[name].partition(":")
        return getattr(import_module(module), attribute or name)
    if name in _MODULES:
        return import_module(_MODULES[name])
    raise AttributeError(f"module 'ftqp' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
