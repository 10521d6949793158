"""Which faults the planner counts on, and what is said of those that nobody announced.

What really fails, and when, is in ``ftqp.sim``.
"""
