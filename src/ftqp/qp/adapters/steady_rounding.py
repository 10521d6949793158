"""Proxsuite, whose fastest builds round by the place of their memory, loaded in the build that does not."""

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_LOG = logging.getLogger(__name__)

PACKAGE = "proxsuite"
FAST_BUILDS = ("proxsuite.proxsuite_pywrap_avx512", "proxsuite.proxsuite_pywrap_avx2")
"""Builds of proxsuite that keep some arrays where malloc puts them, aligned to 16 bytes.

Eigen sums numbers one by one up to the first address that is aligned to its own width, 32 or 64 bytes, and in
packets from there on. So the same input gives sums of another rounding when malloc happens to answer
otherwise, and an iteration that stops at a threshold stops elsewhere. The build for any x86 processor has a
width of 16 bytes, where nothing is left to chance.
"""


@contextmanager
def steady_rounding() -> Iterator[None]:
    """While this lasts, proxsuite is loaded in the build whose answers do not depend on addresses.

    Where somebody has loaded another build before, it stays, and that is said once a use.
    """
    if PACKAGE in sys.modules:
        if any(sys.modules.get(build) is not None for build in FAST_BUILDS):
            _LOG.warning(
                "proxsuite was loaded before ftqp, in a build whose rounding depends on where its memory "
                "lies: proxqp may answer the same QP differently in the last digits; make the planner "
                "before importing proxsuite, pink or qpsolvers"
            )
        yield
        return
    kept_out = [build for build in FAST_BUILDS if build not in sys.modules]
    for build in kept_out:
        sys.modules[build] = None  # type: ignore[assignment]  # so that importing it fails as if not installed
    try:
        yield
    finally:
        for build in kept_out:
            sys.modules.pop(build, None)
