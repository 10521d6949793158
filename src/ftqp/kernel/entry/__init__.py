"""The ways in from Python."""
