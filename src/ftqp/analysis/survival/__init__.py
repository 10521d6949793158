"""Which failures a motion survives: every joint, at every instant of a path."""
