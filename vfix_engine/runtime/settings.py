"""The protocol of a world's settings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, Self


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
