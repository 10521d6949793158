"""Distances of the arm to itself and to what stands around it, and the rows that keep them."""
