"""From a target to a command: reference, schemes, task, bounds, planner. Knows no solver, no file, no
picture."""
