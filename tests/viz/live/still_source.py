"""A source for tests of pages: one arm in one posture, any names, any number for anything."""

import numpy as np

from ftqp.sim.session.frame import DrawnArm, placed
from ftqp.viz.live.stage import Stage


class StillSource:
    """An arm that stands; ``facts`` are what every frame is made of."""

    def __init__(self, robot, **stage):
        self._arm = DrawnArm(robot)
        healthy = self._arm.codes({})
        self.facts = {
            "tick": 0, "t": 0.0, "q": robot.neutral, "v": np.zeros(robot.nv), "truth": healthy,
            "belief": healthy, "target": placed(robot.pose(robot.neutral)), "position_error": 1e-4,
            "step_time_us": 5.0,
        }  # fmt: skip
        self.robot, self.orders, self.more, self.number = robot, [], stage, 0

    def put(self, order):
        self.orders.append(order)

    def frame(self):
        return self._arm.frame(**self.facts, stage=self.number)

    def stage(self):
        texts = {"title": self.robot.name, "scheme": "mvn", "backend": "active_set"}
        return Stage(number=self.number, robot=self.robot, **{**texts, **self.more})

    def become(self, robot):
        """Another arm."""
        number = self.number + 1
        self.__init__(robot, **self.more)
        self.number = number
