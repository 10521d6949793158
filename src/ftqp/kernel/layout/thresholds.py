"""Thresholds that compiled code and Python read alike."""

from typing import Final

SCALED_FROM: Final = 0.999
"""A path scale or a path rate below this counts as scaled."""
