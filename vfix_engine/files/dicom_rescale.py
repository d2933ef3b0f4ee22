"""Rescaling of the slices of a DICOM series, and the unit of their values (PS3.3 C.11.1)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from vfix_engine.errors import ImageError

HU = "HU"
# Defined terms of RescaleType; others are not quoted, since they are text of the file.
_KNOWN = ("OD", HU, "US", "MGML", "Z_EFF", "ED", "EDW", "HU_MOD", "PCT")
_OTHER = "another unit"
_STORED_RANGE = 4096  # number of values in the 12 bits of a CT
_ROUNDING = 0.5  # of a value, which is stored as an integer


class Rescaled(Protocol):
    """A slice with its rescale: slope and intercept, and the unit of its values."""

    @property
    def rescale(self) -> tuple[float, float]: ...

    @property
    def unit(self) -> str: ...

    @property
    def where(self) -> str: ...


def unit_of(dataset: Any) -> str:
    """Unit that a slice states for its values; Hounsfield units by the standard if it states none; '' for MR."""
    if dataset.get("Modality") == "MR":  # its values are arbitrary
        return ""
    said = str(dataset.get("RescaleType") or HU).strip().upper()
    return said if said in _KNOWN else _OTHER


def rescale_notes(slices: Sequence[Rescaled]) -> tuple[str, ...]:
    """List doubts about the values. Raises ImageError if the slices have different units."""
    first = slices[0]
    for one in slices:
        if one.unit != first.unit:
            raise ImageError(
                f"the values of the slices are in different units: {_named(first.unit)} in {first.where}, "
                f"{_named(one.unit)} in {one.where}. They form no one volume; export the series in Hounsfield units."
            )
    return (*_differing(slices), *_foreign(first.unit))


def _differing(slices: Sequence[Rescaled]) -> tuple[str, ...]:
    slopes, intercepts = ([one.rescale[part] for one in slices] for part in (0, 1))
    apart = (max(slopes) - min(slopes)) * _STORED_RANGE, max(intercepts) - min(intercepts)
    if max(apart) <= _ROUNDING:
        return ()
    return (
        f"The slices are rescaled differently: slopes from {min(slopes):g} to {max(slopes):g}, intercepts from "
        f"{min(intercepts):g} to {max(intercepts):g}. Each slice was rescaled by its own.",
    )


def _foreign(unit: str) -> tuple[str, ...]:
    if unit in (HU, ""):
        return ()
    return (
        f"The values are not known to be in Hounsfield units: the file says that they are in {_named(unit)}. Compare "
        "the slices with the scanner's before you trust what is made of them.",
    )


def _named(unit: str) -> str:
    return {HU: "Hounsfield units", "US": "an unspecified unit", "": "the unit of an MR"}.get(unit, unit)
