"""The public names of ftqp and their homes: the one list, for type checkers and for ``ftqp`` itself."""

from typing import Any

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
from ftqp.control.planner.learned_arm import Learned as Learned
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
from ftqp.control.task.keep import Keep as Keep
from ftqp.control.task.linear_rows import Rows as Rows
from ftqp.control.task.resolvers import Damping as Damping
from ftqp.control.task.scheme import Scheme as Scheme
from ftqp.control.task.soft_tasks import AxisTask as AxisTask
from ftqp.control.task.soft_tasks import CentreOfMass as CentreOfMass
from ftqp.control.task.soft_tasks import JointTask as JointTask
from ftqp.control.task.soft_tasks import LeastSquares as LeastSquares
from ftqp.control.task.soft_tasks import PoseTask as PoseTask
from ftqp.control.task.soft_tasks import PositionTask as PositionTask
from ftqp.control.task.soft_tasks import PostureTask as PostureTask
from ftqp.control.task.soft_tasks import RelativeTask as RelativeTask
from ftqp.control.task.task import Task as Task
from ftqp.control.task.torque_limits import TorqueLimits as TorqueLimits
from ftqp.core.errors import FtqpError as FtqpError
from ftqp.core.errors import InputError as InputError
from ftqp.core.errors import MissingPackage as MissingPackage
from ftqp.core.errors import ModelError as ModelError
from ftqp.core.errors import ScenarioError as ScenarioError
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

__version__: str

def __getattr__(name: str) -> Any: ...
