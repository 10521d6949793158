"""What the arm takes, what its sensors are worth, and how both are wired to the planner."""
