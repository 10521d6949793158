"""The tables of a scenario file, strict: unknown keys are errors with the nearest valid key."""

from ftqp.app.schema.scenario_file import Scenario

__all__ = ["Scenario"]
