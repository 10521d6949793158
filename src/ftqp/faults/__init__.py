"""What the planner believes about its joints. What really fails, and when, is in ``ftqp.sim``."""
