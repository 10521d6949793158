"""From a target to a command: reference, schemes, task, bounds, planner; knows no solver, file or picture."""
