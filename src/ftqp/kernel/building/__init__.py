"""Builds the library of the kernel where ftqp is installed or edited, and those of `ftqp build`."""
