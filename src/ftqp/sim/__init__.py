"""Time and truth: what really fails and when, the simulated arm, the loop, its log and its metrics."""
