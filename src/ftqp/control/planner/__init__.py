"""The planner and what it gives back."""
