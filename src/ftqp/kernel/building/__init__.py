"""Builds the library of the kernel where ftqp is installed or edited; no part of what is installed."""
