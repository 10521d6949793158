"""Several arms side by side: the tick that most of them have in common."""
