"""Studies of an arm before it moves."""

from ftqp.analysis.falling import fall_energy as fall_energy
