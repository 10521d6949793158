"""What a planner does about what its detector sees of the arm."""
