"""A plant that bears witness of the commands it was given."""

import numpy as np
from bench.wrapped_plant import WrappedPlant

from ftqp.sim.plants.kinematic_plant import KinematicPlant


class Witness(WrappedPlant):
    """A kinematic plant that keeps by how much each joint differs from its command at most."""

    def __init__(self, robot, dt, level):
        super().__init__(KinematicPlant(robot, dt, level))
        self.differs = np.zeros(robot.nv)

    def advance(self, command):
        q, v = command.q.copy(), command.v.copy()
        self._plant.advance(command)
        np.maximum(self.differs, np.abs(self.q - q) + np.abs(self.v - v), out=self.differs)
