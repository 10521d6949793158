"""LeRobot's SO-101 follower on ftqp; LeRobot imports this package because of its name."""

from lerobot_robot_ftqp.config_so101_ftqp import SO101FtqpConfig as SO101FtqpConfig
from lerobot_robot_ftqp.so101_ftqp import SO101Ftqp as SO101Ftqp
