"""Studies of an arm before it moves: its task rows, its self-motions and its solutions, compiled in bulk."""
