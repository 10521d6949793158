"""A plant that bears witness of the commands it was given."""

import numpy as np

from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.plants.plant import Plant


class Witness(Plant):
    """A kinematic plant that keeps by how much each joint differs from its command at most."""

    def __init__(self, robot, dt, level):
        self._plant = KinematicPlant(robot, dt, level)
        self.differs = np.zeros(robot.nv)

    @property
    def q(self):
        return self._plant.q

    @property
    def v(self):
        return self._plant.v

    @property
    def drive(self):
        return None

    @property
    def tolerance(self):
        return 0.0

    @property
    def motors(self):
        return None

    @property
    def failure(self):
        return None

    def reset(self, q, v):
        self._plant.reset(q, v)

    def fail(self, fault):
        self._plant.fail(fault)

    def repair(self, joint):
        self._plant.repair(joint)

    def advance(self, command):
        q, v = command.q.copy(), command.v.copy()
        self._plant.advance(command)
        np.maximum(self.differs, np.abs(self.q - q) + np.abs(self.v - v), out=self.differs)
