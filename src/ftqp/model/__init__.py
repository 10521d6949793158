"""Robots: what a planner needs to know of an arm, read from URDF, MJCF, DH tables or pinocchio."""
