"""Work on other threads whose failure is reported: unexpected errors to the log, and to the user in words."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Executor

from vfix_engine.error_places import error_places
from vfix_engine.errors import VfixError

Work = Callable[[], None]
Failed = Callable[[str], object]
_LOG = logging.getLogger(__name__)


def in_background(executor: Executor, what: str, work: Work, failed: Failed) -> None:
    """Do the work on a thread of the executor. failed: called there with words for the user if it raises.

    what: the words for an unexpected error, such as 'The bone could not be counted'; else the error's own.
    """
    executor.submit(guarded, what, work, failed)


def guarded(what: str, work: Work, failed: Failed) -> None:
    """Do the work at once; `what` and `failed` as in :func:`in_background`."""
    try:
        work()
    except VfixError as error:
        failed(str(error))
    except Exception as error:
        _LOG.error("%s: %s", what, error_places(error))
        failed(f"{what}; the planner's log says why.")
