"""Inverse kinematics of the joints that work: postures that put the tip where it shall be."""
