"""Planners that are disturbed from inside: in their memory, at any line, by threads and by objects."""
