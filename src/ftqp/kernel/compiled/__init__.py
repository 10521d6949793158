"""How the kernel becomes machine code: compiled once, kept in a folder that is ours, loaded without numba."""
