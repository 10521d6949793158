"""Who solves a planner's QPs."""
