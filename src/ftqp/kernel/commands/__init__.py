"""Commands to a planner between its steps: its start, faults, loads and stops, as formulas on its record."""
