"""The trials of ``farm.run_all`` on the workers of a Dask scheduler; needs the extra ``cluster``.

Of many trials a few are one task, since a task costs some 20 ms; few trials are long ones, and a task each. The
scheduler runs the tasks of a killed worker again.
"""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable, Hashable, Sequence
from typing import Any, TypeVar

from ..errors import ControlError, InputError

TRIALS_OF_TASK = 5  # at most
TASKS = 100  # at least, before trials share one
CONNECT_S = 20.0
ADDRESS = "tcp://"

K = TypeVar("K", bound=Hashable)
V = TypeVar("V")


def run_on_cluster(function: Callable[[K], V], keys: Sequence[K], address: str, add: Callable[[K, V], object]) -> None:
    """Run all keys, and call ``add`` with each result as it comes. Raises as ``farm.run_all``."""
    if not address.startswith(ADDRESS):
        raise InputError(f"a scheduler's address begins with {ADDRESS}, not {address!r:.60}")
    try:
        import distributed
    except ImportError:
        raise InputError("a Dask scheduler needs more packages: pip install 'vfix[cluster]'") from None
    try:
        client = distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(f"no Dask scheduler answers at {address!r:.60}: {error}") from error
    with client:
        if not keys:
            return
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # the data of all trials are large, and are meant to be
            # A task, which the scheduler runs again where the last worker that had its result was killed.
            sent = client.submit(pickle.loads, pickle.dumps(function), pure=False)
        size = min(max(len(keys) // TASKS, 1), TRIALS_OF_TASK)
        batches = [list(keys[first : first + size]) for first in range(0, len(keys), size)]
        tasks = [client.submit(_run_batch, sent, batch, pure=False) for batch in batches]
        try:
            for task in distributed.as_completed(tasks, loop=client.loop):
                _add(task, add)
        except BaseException:
            client.cancel(tasks)
            raise


def _add(task: Any, add: Callable[[Any, Any], object]) -> None:
    """Raises ControlError for a task that killed each worker that had it."""
    from distributed import KilledWorker

    try:
        found = task.result()
    except KilledWorker as error:
        raise ControlError(f"some trials lost their worker each time: {error}") from error
    for key, value in found:
        add(key, value)


def _run_batch(function: Callable[[Any], Any], keys: list[Any]) -> list[tuple[Any, Any]]:
    return [(key, function(key)) for key in keys]
