"""Failures that nobody announced: a detector, its calibration, and what it says."""
