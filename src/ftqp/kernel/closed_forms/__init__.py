"""Closed forms in the place of the QP, and measures of singularity."""
