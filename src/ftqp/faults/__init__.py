"""Which faults the planner counts on. What really fails, and when, is in ``ftqp.sim``."""
