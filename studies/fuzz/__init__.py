"""Corrupted inputs of ``planner.step`` and of the calls around it, and who judges what comes back."""
