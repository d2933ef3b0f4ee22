"""Background work at start-up that makes the first click fast, while the page already opens."""

import logging
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

from vfix_engine.error_places import error_places

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class WarmUpStep:
    """A piece of work and the text shown while it runs, which may include its progress.

    needed: evaluated when its turn comes. optional: if it fails, the next step begins all the same.
    """

    text: str | Callable[[], str]
    work: Callable[[], object]
    needed: Callable[[], bool] = lambda: True
    optional: bool = False


@dataclass(frozen=True)
class WarmUpStatus:
    """Status for the page: `text` is empty once everything is ready; `failed` is the reason of a failure."""

    text: str
    ready: bool
    failed: str = ""


class WarmUp:
    """Runs its steps once, in order, on a thread; `status` is thread-safe.

    beside: steps on a thread of their own, which the status does not wait for; failures are logged.
    ends: exceptions that a step raises because the planner shuts down, which is no failure; no other step begins then.
    """

    def __init__(
        self,
        steps: Sequence[WarmUpStep],
        beside: Sequence[WarmUpStep] = (),
        ends: tuple[type[Exception], ...] = (),
    ) -> None:
        self._steps, self._beside, self._ends = tuple(steps), tuple(beside), ends
        self._done = threading.Event()
        self._text: str | Callable[[], str] = "Getting ready"
        self._ready, self._failed = False, ""

    @property
    def status(self) -> WarmUpStatus:
        """The current status."""
        text = self._text
        return WarmUpStatus(text if isinstance(text, str) else text(), self._ready, self._failed)

    def start(self) -> None:
        """Start the threads, which do not keep the process alive."""
        for name, run in (("warm-up", self._get_ready), ("warm-up-beside", self._do_beside)):
            threading.Thread(target=run, name=name, daemon=True).start()

    def wait(self, timeout: float) -> bool:
        """Wait for the end, successful or not; False after `timeout` seconds."""
        return self._done.wait(timeout)

    def _do_beside(self) -> None:
        with suppress(*self._ends):
            for step in self._beside:
                self._take(step, shown=False)

    def _get_ready(self) -> None:
        try:
            for step in self._steps:
                self._take(step)
            self._ready = True
        except self._ends:
            pass  # the planner shuts down: no failure, and nothing is ready
        except Exception as error:
            _LOG.error("getting ready failed: %s", error_places(error))
            self._failed = f"Getting ready failed: {error}"
        finally:
            self._text = ""
            self._done.set()

    def _take(self, step: WarmUpStep, shown: bool = True) -> None:
        if not step.needed():
            return
        if shown:
            self._text = step.text
        try:
            step.work()
        except self._ends:
            raise
        except Exception as error:
            if shown and not step.optional:
                raise
            _LOG.error("getting ready goes on without a step that failed: %s", error_places(error))
