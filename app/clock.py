"""The time as it is stored and written."""

from datetime import UTC, datetime


def utc_now() -> str:
    """The time now, ISO 8601 in UTC."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def local_now() -> datetime:
    """The time now, of this machine's time zone."""
    return datetime.now(UTC).astimezone()
