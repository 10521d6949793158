"""``ftqp build``: a planner as a library in C, the arm's file, and a folder that builds as it lies."""
