"""Planners that are disturbed from inside: their memory, their lines, their threads, their caller's objects."""
