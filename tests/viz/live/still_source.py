"""A source for tests of pages: one arm in one posture, any names, any number for anything."""

import numpy as np

from ftqp.core.pose import quaternions
from ftqp.sim.session.tick_facts import Facts
from ftqp.viz.live.frame import DrawnArm, Stage, frame_of


class StillSource:
    """An arm that stands; ``facts`` are what every frame is made of."""

    def __init__(self, robot, **stage):
        n = robot.nv
        pose = robot.pose(robot.neutral)
        self.facts = {
            "tick": 0, "t": 0.0, "q": robot.neutral, "v": np.zeros(n),
            "truth": np.zeros(n, dtype=np.int64), "belief": np.zeros(n, dtype=np.int64),
            "target_position": pose[:3, 3], "target_quaternion": quaternions(pose[None, :3, :3])[0],
            "status": 0, "path_status": 0, "position_error": 1e-4, "rotation_error": 0.0, "step_time": 5.0,
        }  # fmt: skip
        self.robot, self.orders, self.more, self.number = robot, [], stage, 0
        self._arm = DrawnArm(robot)

    def put(self, order):
        self.orders.append(order)

    def frame(self):
        return frame_of(Facts(**self.facts, stage=self.number), self._arm)

    def stage(self):
        texts = {"title": self.robot.name, "scheme": "mvn", "backend": "active_set"}
        return Stage(number=self.number, robot=self.robot, **{**texts, **self.more})

    def become(self, robot):
        """Another arm."""
        number = self.number + 1
        self.__init__(robot, **self.more)
        self.number = number
