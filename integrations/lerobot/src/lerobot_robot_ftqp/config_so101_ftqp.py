"""The options of the robot, by which LeRobot finds it: ``--robot.type=so101_ftqp``."""

from dataclasses import dataclass

from lerobot.robots.config import RobotConfig
from lerobot.robots.so_follower import SOFollowerConfig


@RobotConfig.register_subclass("so101_ftqp")
@dataclass
class SO101FtqpConfig(RobotConfig, SOFollowerConfig):
    """Options of an SO-101 or SO-100 whose servos are watched, beside those of LeRobot's follower.

    Args:
        urdf: The URDF of the arm, with joints named as the motors.
        tip: The link that is led after a failure.
        fps: How often the loop runs [1/s].
        acceleration: The joints' acceleration limits [rad/s2]; URDFs have none.
    """

    urdf: str = ""
    tip: str = "gripper_frame_link"
    fps: float = 30.0
    acceleration: float | None = None
