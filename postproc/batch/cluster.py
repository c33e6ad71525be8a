"""One search of a large part on the workers of a Dask cluster, or on processes of this computer."""

from __future__ import annotations

import multiprocessing
import pickle
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager
from hashlib import sha256
from typing import Any, Generic, TypeVar, cast

from postproc.base.team import Crew, Processes, working
from postproc.batch.run import Where, client_of
from toolpaths.extras import need

S = TypeVar("S")
V = TypeVar("V")
R = TypeVar("R")
KEPT = 4
"""things that a worker keeps unpacked"""
_UNPACKED: OrderedDict[str, tuple[Callable[[object, object], object], object]] = OrderedDict()


@contextmanager
def spread(where: Where) -> Iterator[None]:
    """Searches that are begun here run on the cluster of `where.scheduler`, else on `where.workers` processes of this
    computer; 0: as many as it has cores, where they can be forked.

    Raises:
        DiagnosticError: where the scheduler cannot be reached or its workers have another version.
    """
    with ExitStack() as stack:
        if where.scheduler:
            need("distributed", "--scheduler needs")
            stack.enter_context(working(Cluster(client_of(where, stack))))
        elif where.workers and not multiprocessing.current_process().daemon:  # those of a batch begin no processes
            stack.enter_context(working(Processes(where.workers)))
        yield


class Cluster:
    """The workers of a scheduler."""

    def __init__(self, client: Any) -> None:
        self.client = client
        self.size = max(len(client.scheduler_info(n_workers=-1)["workers"]), 2)

    def crew(self, function: Callable[[S, V], R], shared: S) -> Crew[V, R]:
        """See `Team`."""
        return _OnCluster(self.client, function, shared)


class _OnCluster(Generic[V, R]):
    """The scheduler keeps what is shared, packed: a worker that takes the place of one that has ended gets it too."""

    def __init__(self, client: Any, function: Callable[[S, V], R], shared: S) -> None:
        self.client, self.alone = client, cast(Callable[[V], R], lambda item: function(shared, item))
        packed = pickle.dumps((function, shared), pickle.HIGHEST_PROTOCOL)
        self.mark = sha256(packed).hexdigest()
        self.packed = client.submit(bytes, packed, pure=False)

    def results(self, items: Sequence[V]) -> Iterator[R]:
        """See `Crew`: what no worker could end, and all that is left where the scheduler is gone, this process does."""
        from distributed import KilledWorker

        futures = [self.client.submit(_done, self.packed, self.mark, item, pure=False, retries=0) for item in items]
        try:
            for future, item in zip(futures, items, strict=True):
                try:
                    yield cast(R, future.result())
                except (KilledWorker, CancelledError, OSError):
                    yield self.alone(item)
        finally:
            for future in futures:
                future.release()

    def close(self) -> None:
        """See `Crew`."""
        self.packed.release()


def _done(packed: bytes, mark: str, item: object) -> object:
    """On a worker."""
    if mark not in _UNPACKED:
        _UNPACKED[mark] = pickle.loads(packed)
        while len(_UNPACKED) > KEPT:
            _UNPACKED.popitem(last=False)
    function, shared = _UNPACKED[mark]
    return function(shared, item)
