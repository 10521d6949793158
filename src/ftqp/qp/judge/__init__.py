"""One QP, solved and judged."""
