"""Settling: the curvature of the error that is left as a metric, so that the arm comes to rest."""
