"""What a planner is made with: task, scheme, bounds, emergency stop."""
