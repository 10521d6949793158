"""Whole ticks: the parts of one in their order, for each leader and each solver."""
