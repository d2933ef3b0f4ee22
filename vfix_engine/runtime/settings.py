"""The protocol of a world's settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, Self, TypeVar

from ..errors import InputError


class SettingRange(Protocol):
    """Closed range of one setting, its unit and its label."""

    @property
    def low(self) -> float: ...
    @property
    def high(self) -> float: ...
    @property
    def unit(self) -> str: ...
    @property
    def label(self) -> str: ...


class WorldSettings(Protocol):
    """Immutable settings of a world, validated on construction."""

    @staticmethod
    def bounds() -> Mapping[str, SettingRange]:
        """Return the range of every numeric setting by its name."""
        ...

    def clamped(self, /, **changes: float) -> Self:
        """Return a copy with changes clipped to their ranges. Raises InputError for an unknown name."""
        ...

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        ...

    @classmethod
    def from_dict(cls, data: dict[str, Any], /) -> Self:
        """Inverse of ``to_dict``. Raises InputError."""
        ...


W = TypeVar("W", bound=WorldSettings)


def checked_settings(settings: object, kind: type[W], whose: str) -> W:
    """Settings of a request, equal to those that were sent, by their constructor: a recorded one was made without it.

    whose: for messages, such as 'the rigid tool'. Raises InputError for another kind, or a value out of its range.
    """
    if not isinstance(settings, kind):
        raise InputError(f"{whose} is driven with {kind.__name__}, not with {settings!r:.60}")
    return kind.from_dict(settings.to_dict())


@dataclass(frozen=True)
class NoSettings:
    """The settings of a world that has none."""

    @staticmethod
    def bounds() -> Mapping[str, SettingRange]:
        return {}

    def clamped(self, /, **changes: float) -> Self:
        if changes:
            raise InputError(f"this world has no settings, and no '{next(iter(changes)):.40}'")
        return self

    def to_dict(self) -> dict[str, Any]:
        return {}

    @classmethod
    def from_dict(cls, data: dict[str, Any], /) -> Self:
        return cls().clamped(**data)
