"""Failures that nobody announced: observers, residuals, suspicion and fault isolation."""
