"""The one shape in which an error leaves the planner: over HTTP, over a WebSocket and from the command line."""

import re
from typing import Any

_WORD_START = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")


def error_code(error: BaseException) -> str:
    """A stable word for a kind of error: FrameError becomes 'frame_error'."""
    return _WORD_START.sub("_", type(error).__name__).lower()


def error_details(error: BaseException) -> dict[str, list[Any]] | None:
    """What a client needs beyond the words: which of 'frame', 'unit', 'series', 'into' and 'points_as' it has to name.

    series: of which it has to choose one.
    """
    missing, series = getattr(error, "missing", ()), getattr(error, "series", ())
    details = {"missing": list(missing)} if missing else {}
    return (details | {"series": list(series)} if series else details) or None


def error_body(code: str, message: str, details: Any = None) -> dict[str, Any]:
    """The JSON object of an error: {"error": {"code", "message", "details"}}; details only where there are some."""
    error: dict[str, Any] = {"code": code, "message": message}
    if details is not None:
        error["details"] = details
    return {"error": error}
