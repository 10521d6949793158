"""Kinematics and dynamics of one arm."""
