"""Judges runs from outside: the arm from its model file by pinocchio, the truth from the plant.

Not a line is shared with what it judges: of ftqp it may import ``ftqp.core`` alone, and nothing below ``app``
may import it.
"""
