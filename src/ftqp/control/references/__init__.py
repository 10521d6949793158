"""What a planner is led by when its goal jumps: references that move with limited jerk."""
