"""Bases that move, and what moves them."""
