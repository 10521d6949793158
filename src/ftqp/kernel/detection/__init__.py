"""Failures that nobody announced: observers, residuals, suspicion, and what they are told apart by."""
