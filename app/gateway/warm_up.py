"""Work that makes the first click quick, done in the background while the page already opens."""

import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class WarmUpStep:
    """A piece of work and the words shown while it runs, which may tell how far it is.

    needed: asked when its turn comes. spare: when it fails the next step begins, which then does without it.
    """

    text: str | Callable[[], str]
    work: Callable[[], object]
    needed: Callable[[], bool] = lambda: True
    spare: bool = False


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
        self._text: str | Callable[[], str] = "Getting ready"
        self._ready, self._failed = False, ""

    @property
    def status(self) -> WarmUpStatus:
        """Where it is now."""
        text = self._text
        return WarmUpStatus(text if isinstance(text, str) else text(), self._ready, self._failed)

    def start(self) -> None:
        """Begin; the thread does not keep the process alive."""
        threading.Thread(target=self._run, name="warm-up", daemon=True).start()

    def wait(self, timeout: float) -> bool:
        """Wait until it has ended, well or not; False when it has not within `timeout` seconds."""
        return self._done.wait(timeout)

    def _run(self) -> None:
        try:
            for step in self._steps:
                self._take(step)
            self._ready = True
        except Exception as error:
            _LOG.exception("getting ready failed")
            self._failed = f"Getting ready failed: {error}"
        finally:
            self._text = ""
            self._done.set()

    def _take(self, step: WarmUpStep) -> None:
        if not step.needed():
            return
        self._text = step.text
        try:
            step.work()
        except Exception:
            if not step.spare:
                raise
            _LOG.exception("getting ready goes on without a step that failed")
