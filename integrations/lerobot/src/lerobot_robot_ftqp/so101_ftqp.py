"""An SO-101 whose servos are watched: when one gives up, the others go on."""

from typing import Any

import numpy as np
from lerobot.motors.feetech import FeetechMotorsBus
from lerobot.robots.so_follower import SOFollower

import ftqp
from lerobot_robot_ftqp.config_so101_ftqp import SO101FtqpConfig
from lerobot_robot_ftqp.kinematics import RobotKinematics

TABLE = ftqp.vendors.table("feetech")
GRIPPER = "gripper"


class StatusBus(FeetechMotorsBus):
    """LeRobot's bus, which keeps the status that each servo sends with its position.

    Attributes:
        status: Status byte of each motor at the last read.
        temperature: Temperature of each motor at the last read [C].
    """

    def __init__(self, *args: Any, **given: Any) -> None:
        super().__init__(*args, **given)
        self.status: dict[str, int] = {}
        self.temperature: dict[str, int] = {}

    def sync_read(
        self, data_name: str, motors: Any = None, *, normalize: bool = True, num_retry: int = 0
    ) -> dict[str, Any]:
        """Read a register of several motors; positions come with the status, in one answer a servo."""
        if data_name != "Present_Position" or motors is not None:
            return super().sync_read(data_name, motors, normalize=normalize, num_retry=num_retry)
        ids = {motor.id: name for name, motor in self.motors.items()}
        block = TABLE.block
        assert block is not None
        self._setup_sync_reader(list(ids), block["address"], block["length"])
        for _ in range(1 + num_retry):
            # or a late answer is taken for that of this question; clearPort empties the output only
            self.port_handler.ser.reset_input_buffer()
            if self._is_comm_success(self.sync_reader.txRxPacket()):
                break
        else:
            raise ConnectionError(f"no whole answer from the servos {list(ids)} after {num_retry + 1} tries")
        told = {
            field: {one: self.sync_reader.getData(one, *place) for one in ids}
            for field, place in block["fields"].items()
        }
        self.status = {name: told["status"][one] for one, name in ids.items()}
        self.temperature = {name: told["temperature"][one] for one, name in ids.items()}
        found = self._decode_sign(data_name, told["position"])
        found = self._normalize(found) if normalize else found
        return {ids[one]: value for one, value in found.items()}


class SO101Ftqp(SOFollower):
    """LeRobot's SO-101 follower; when a servo switches itself off, the others lead the gripper on.

    Attributes:
        kinematics: What leads after a failure; ``kinematics.planner`` has the faults.
        watch: What looks at the servos; ``watch.standing`` says what has failed, and why.

    Raises:
        ftqp.InputError: No URDF, one whose joints are not named as the motors, or angles that are no degrees.
    """

    config_class = SO101FtqpConfig
    name = "so101_ftqp"

    def __init__(self, config: SO101FtqpConfig) -> None:
        super().__init__(config)
        if not config.urdf:
            raise ftqp.InputError("urdf is empty, expected the file of the arm: --robot.urdf=so101.urdf")
        if not config.use_degrees:
            raise ftqp.InputError("use_degrees is False, expected True: ftqp has to know the joint angles")
        self.bus = StatusBus(self.bus.port, self.bus.motors, self.bus.calibration)
        self._arm = [name for name in self.bus.motors if name != GRIPPER]
        self.kinematics = RobotKinematics(
            config.urdf, config.tip, self._arm, fps=config.fps, acceleration=config.acceleration
        )
        self.watch = ftqp.vendors.Watch(self.kinematics.planner, TABLE, joints=self._arm)
        self._measured: np.ndarray | None = None
        self._held: np.ndarray | None = None

    def get_observation(self) -> dict[str, Any]:
        """What LeRobot's follower sees; the status of the servos is looked at, and failures are reported."""
        observation = super().get_observation()
        measured = np.array([observation[f"{name}.pos"] for name in self._arm])
        status = {"status": [self.bus.status[name] for name in self._arm]}
        believed = self.watch.look(status, self.kinematics.angles(measured))
        for joint, angle in zip(self.kinematics.robot.joints, believed, strict=True):
            if np.isnan(angle) and self._measured is not None:  # a lost sensor: where it was seen last
                place = self._arm.index(joint)
                measured[place] = self._measured[place]
        self._measured = measured
        if self.watch.arm == "goes_on":
            self._held = None
        elif self._held is None:
            self._held = measured
        return observation

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        """Send joint angles [deg]; after a failure those that lead the gripper where they meant to.

        While the watch says that the arm is paused or off, it is held where it was then.

        Returns:
            What was sent.
        """
        keys = [f"{name}.pos" for name in self._arm]
        led = self._held
        if led is None and self._measured is not None and self.kinematics.planner.faults:
            asked = np.array([action.get(key, at) for key, at in zip(keys, self._measured, strict=True)])
            pose = self.kinematics.forward_kinematics(asked)
            led = self.kinematics.inverse_kinematics(self._measured, pose)
        sent = {} if led is None else dict(zip(keys, map(float, led), strict=True))
        return super().send_action({**action, **sent})

    def recover(self, joint: str) -> bool:
        """Lead a servo out of its overload, at rest where it stands, once what blocked it has gone.

        It is written to by ``sync_write``, which no servo answers: LeRobot's ``write`` raises at an overload.

        Args:
            joint: Its motor's name.

        Returns:
            Whether it works again, and is led again; else try later, or switch its power off and on.

        Raises:
            ftqp.InputError: Nothing stands of it, or a person has to look first; then ``repaired`` ends it.
        """
        first = self.watch.recover(joint).next
        if first is None or first.by != "program":
            raise ftqp.InputError(
                f"{joint}: {'' if first is None else first.do}; then robot.repaired({joint!r})"
            )
        place = self.bus.sync_read("Present_Position", normalize=False)[joint]
        for register, value in (("Torque_Enable", 0), ("Goal_Position", place), ("Torque_Enable", 1)):
            self.bus.sync_write(register, {joint: value}, normalize=False)
        self.bus.sync_read("Present_Position")
        works = self.bus.status[joint] == 0
        if works:
            self.watch.withdraw(joint)
        return works

    def repaired(self, joint: str) -> None:
        """A servo works again.

        Args:
            joint: Its motor's name.
        """
        self.watch.withdraw(joint)
