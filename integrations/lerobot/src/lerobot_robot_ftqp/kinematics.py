"""LeRobot's ``RobotKinematics`` on ftqp: limits are kept, and a servo that gives up is no end of the task.

LeRobot asks two things of a robot's kinematics: where the gripper is for joint angles, and which angles to
send next so that it goes where a policy or a teleoperator wants it. Here the second is one tick of an ftqp
planner: the angles that it returns keep the joints' ranges, speeds and accelerations.

    kinematics = RobotKinematics("so101.urdf", "gripper_frame_link", joint_names=MOTORS[:5])
    kinematics.report_overload("wrist_flex")          # the servo has switched itself off, or is blocked
    kinematics.repaired("wrist_flex")

It has the interface of LeRobot 0.6, and was tried against a stand-in of it, not on a robot.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import ftqp

FPS = 30.0
"""How often LeRobot asks, unless it is told otherwise [1/s]."""
FARTHEST = np.deg2rad(15.0)
"""Joints farther than this from what was sent were moved by hand: the planner begins there [rad]."""


class RobotKinematics:
    """Forward and inverse kinematics with the signatures of ``lerobot.model.kinematics.RobotKinematics``.

    Args:
        urdf_path: The URDF of the arm.
        target_frame_name: The link that is led.
        joint_names: The joints in LeRobot's order; None are those on the way to the link.
        fps: How often ``inverse_kinematics`` is called [1/s].
        acceleration: The joints' acceleration limits [rad/s2]; URDFs have none.
    """

    def __init__(
        self,
        urdf_path: str | Path,
        target_frame_name: str = "gripper_frame_link",
        joint_names: Sequence[str] | None = None,
        *,
        fps: float = FPS,
        acceleration: float | None = None,
    ) -> None:
        self.robot = ftqp.Robot.from_urdf(urdf_path, target_frame_name, acceleration=acceleration)
        self.joint_names = list(self.robot.joints if joint_names is None else joint_names)
        if missing := [name for name in self.robot.joints if name not in self.joint_names]:
            raise ftqp.InputError(
                f"joint_names lacks {', '.join(missing)} on the way to {target_frame_name}; it has "
                f"{', '.join(self.joint_names)}"
            )
        self._order = [self.joint_names.index(name) for name in self.robot.joints]
        self.planner = ftqp.Planner(
            self.robot,
            dt=1.0 / fps,
            level="velocity",
            tasks=[
                ftqp.Task("position", kp=fps),  # there by the next call, if limits allow it
                ftqp.PoseTask(target_frame_name, rows="orientation", name="orientation", weight=0.01),
            ],
            emergency=None,
        )
        self._sent: np.ndarray | None = None
        self._observed: np.ndarray | None = None
        self.step: Any = None

    def forward_kinematics(self, joint_pos_deg: np.ndarray) -> np.ndarray:
        """Pose of the link, (4, 4) [m], at joint angles [deg]; a gripper's entry counts nothing."""
        return self.robot.pose(self.angles(joint_pos_deg))

    def inverse_kinematics(
        self,
        current_joint_pos: np.ndarray,
        desired_ee_pose: np.ndarray,
        position_weight: float = 1.0,
        orientation_weight: float = 0.01,
    ) -> np.ndarray:
        """Joint angles to send next [deg], as many as are given; a gripper's entry is handed back.

        Args:
            current_joint_pos: Measured joint angles [deg].
            desired_ee_pose: Where the link should go, (4, 4) [m].
            position_weight: Beside it the orientation counts by ``orientation_weight`` over this.
            orientation_weight: 0 leaves the orientation free.
        """
        q = self.angles(current_joint_pos if self._observed is None else self._observed)
        self._observed = None
        if self._sent is None or np.abs(q - self._sent).max() > FARTHEST:
            self.planner.reset(q)
        self.planner.tasks["orientation"].weight = orientation_weight / position_weight
        pose = np.asarray(desired_ee_pose, dtype=float)
        self.step = self.planner.step(q, None, {"tip": ftqp.Target(pose=pose), "orientation": pose})
        self._sent = self.step.q.copy()
        result = np.array(current_joint_pos, dtype=float)
        result[self._order] = np.rad2deg(self._sent)
        return result

    def observe(self, joint_pos_deg: np.ndarray) -> None:
        """Say what is measured, where the next call is handed the last command instead.

        LeRobot's processors do so with ``initial_guess_current_joints=False``; without this an arm that
        does not follow would be taken for one that does.

        Args:
            joint_pos_deg: Measured joint angles [deg].
        """
        self._observed = np.array(joint_pos_deg, dtype=float)

    def reset(self) -> None:
        """Begin anew where the arm is at the next call; no processor of LeRobot's says so by itself."""
        self._sent = self._observed = None

    def report_overload(self, joint: str) -> None:
        """A servo has switched itself off at its overload, or is blocked: the others go on without it."""
        self.planner.report(ftqp.Locked(joint))

    def repaired(self, joint: str) -> None:
        """The servo works again."""
        self.planner.withdraw(joint)

    @property
    def sentence(self) -> str:
        """How the last call ended, in words."""
        return "nothing has been asked yet" if self.step is None else str(self.step.status.value)

    def angles(self, degrees: np.ndarray) -> np.ndarray:
        """The arm's joints in the order of the model [rad]."""
        given = np.asarray(degrees, dtype=float)
        if given.ndim != 1 or len(given) <= max(self._order):
            raise ftqp.InputError(
                f"joint angles have shape {given.shape}, expected one number for each of "
                f"{', '.join(self.joint_names)} [deg]"
            )
        return np.deg2rad(given[self._order])
