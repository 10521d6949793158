"""Nothing is said of arms that are only thought of."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from threading import get_ident


@contextmanager
def quiet() -> Iterator[None]:
    """Nothing that this thread does is logged: it is about an arm that is only thought of."""
    here, logger = get_ident(), logging.getLogger("ftqp")

    def others(record: logging.LogRecord) -> bool:
        return record.thread != here

    try:
        logger.addFilter(others)
        yield
    finally:
        logger.removeFilter(others)
