"""One file a solver; its package is imported there only, when the backend is first asked for."""
