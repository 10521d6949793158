"""A Dask cluster computes the chunks of a study."""

import socket
from concurrent.futures import Future
from typing import Any, final

from ftqp import __version__
from ftqp.app.study.workers import Computed, Work, Workers, compute
from ftqp.core.errors import InputError, MissingPackage
from ftqp.core.extras import remedy_for_extra

TIMEOUT = 10.0
"""A scheduler has so long to answer [s]."""


def _version() -> str:
    """The version of ftqp of a worker."""
    return __version__


@final
class DaskCluster(Workers):
    """Computes chunks on the workers of a Dask scheduler, which have the same ftqp installed."""

    chunk_seconds = 5.0

    def __init__(self, work: Work, address: str) -> None:
        try:
            from distributed import Client, KilledWorker
            from distributed.comm import parse_address, parse_host_port
        except ImportError as error:
            raise MissingPackage("--dask", "distributed", remedy_for_extra("distributed")) from error
        self.death = (KilledWorker,)  # of a chunk at which so many died that the scheduler gave it up
        try:
            scheme, place = parse_address(address)
            if scheme in (
                "tcp",
                "tls",
            ):  # a client that finds nobody is left behind, and can block the next one
                socket.create_connection(parse_host_port(place), TIMEOUT).close()
            self._client = Client(address, timeout=TIMEOUT, set_as_default=False)
        except (OSError, ValueError, TypeError, ImportError) as error:
            raise InputError(
                f"no Dask scheduler answers at {address!r:.100} ({str(error).partition(chr(10))[0]:.120}); "
                "start one with: dask scheduler, and its workers with: dask worker ADDRESS"
            ) from error
        try:
            self.count = self._threads(address)
            self._executor = self._client.get_executor(pure=False)
            self._work = work  # sent with every chunk: what is scattered is lost with its workers
        except BaseException:
            self._client.close()
            raise

    def _threads(self, address: str) -> int:
        """How many chunks the cluster computes at a time."""
        threads = self._client.ncores()
        if not threads:
            raise InputError(
                f"the Dask scheduler at {address} has no workers; start some: dask worker {address}"
            )
        versions: dict[str, Any] = self._client.run(_version, on_error="return")
        for worker, version in versions.items():
            if version != __version__:
                raise InputError(
                    f"the Dask worker {worker} has ftqp {version!s:.80}, this is {__version__}; install "
                    "the same on all workers"
                )
        return int(sum(threads.values()))

    def submit(self, items: tuple[int, ...]) -> "Future[Computed]":
        future: Future[Computed] = self._executor.submit(compute, self._work, items)
        return future

    def close(self) -> None:
        self._executor.shutdown(wait=False)
        self._client.close()
