"""Work that makes the first click quick, done in the background while the page already opens."""

import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class WarmUpStep:
    """A piece of work and the words shown while it runs."""

    text: str
    work: Callable[[], object]


@dataclass(frozen=True)
class WarmUpStatus:
    """What the page shows: `text` is empty once everything is ready; `failed` says why it never will be."""

    text: str
    ready: bool
    failed: str = ""


class WarmUp:
    """Runs its steps once, in order, on a thread; `status` may be read from any thread."""

    def __init__(self, steps: Sequence[WarmUpStep]) -> None:
        self._steps = tuple(steps)
        self._done = threading.Event()
        self.status = WarmUpStatus("Getting ready", ready=False)

    def start(self) -> None:
        """Begin; the thread does not keep the process alive."""
        threading.Thread(target=self._run, name="warm-up", daemon=True).start()

    def wait(self, timeout: float) -> bool:
        """Wait until it has ended, well or not; False when it has not within `timeout` seconds."""
        return self._done.wait(timeout)

    def _run(self) -> None:
        try:
            for step in self._steps:
                self.status = WarmUpStatus(step.text, ready=False)
                step.work()
            self.status = WarmUpStatus("", ready=True)
        except Exception as error:
            _LOG.exception("getting ready failed")
            self.status = WarmUpStatus("", ready=False, failed=f"Getting ready failed: {error}")
        finally:
            self._done.set()
