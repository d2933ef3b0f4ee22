"""How far a process is that compiles kernels at their first call: it looks dead for a minute and is not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba.core.event import Listener, install_listener

_KIND = "numba:compile"


class _Told(Listener):
    """Tells how many kernels were compiled, at each that begins or ends."""

    def __init__(self, tell: Callable[[int], object]) -> None:
        self._tell, self._done = tell, 0

    def on_start(self, event: Any) -> None:
        self._tell(self._done)

    def on_end(self, event: Any) -> None:
        self._done += 1
        self._tell(self._done)


@contextmanager
def compilation_told(tell: Callable[[int], object]) -> Iterator[None]:
    """Call ``tell`` with the number of kernels compiled so far, whenever one begins or ends; loading tells nothing."""
    with install_listener(_KIND, _Told(tell)):
        yield
