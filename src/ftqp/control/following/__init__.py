"""Following a path by its progress."""
