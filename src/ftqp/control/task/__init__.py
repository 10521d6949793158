"""What a planner is told once: task, scheme, bounds, emergency stop."""
