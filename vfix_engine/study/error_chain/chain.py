"""The error chain: its stages as values, read from and written to JSON; and sizes for the robot of the papers."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Self

from numpy.typing import ArrayLike

from ...errors import InputError
from ...validate import whole
from .stages import Compliance, EncoderError, HeadMotion, RegistrationError, ServoLag

SCHEMA = "vfix-errors/1"
LONGEST_FILE = 100_000  # bytes
FLE_MM = 0.667  # rms: five fiducials then have the mean residual of 0.473 mm that Li 2007, section V.B prints

# Each size of ``ErrorChain.papers`` by its key: what is printed, or why it is assumed.
PAPERS: Mapping[str, str] = {
    "registration": "drawn for a localisation error of 0.667 mm rms, with which five fiducials have the mean residual "
    "of 0.473 mm that Li 2007, section V.B prints",
    "encoders.noise_mm": "assumed: no size is printed",
    "encoders.noise_rad": "assumed: no size is printed",
    "encoders.backlash_mm": "assumed: Li 2004, section V names backlash as an error, without a size",
    "encoders.backlash_rad": "assumed: as large at the tip, 200 mm away, as that of a prismatic joint",
    "servo.time_s": "assumed: one period of the printed loop of 30 Hz",
    "compliance.mm_per_n": "assumed: Li 2007, section V.F names deflection under the hand as the main reason for the "
    "larger error of hands-on, without a size",
    "compliance.hand_weight_n": "assumed: a hand that rests on the handle",
    "head": "none: the skull of both papers was a phantom that did not move",
}


@dataclass(frozen=True)
class ErrorChain:
    """The stages between where a run has the tool and where it truly is; None: without this error.

    seed: of the encoders' noise; the same chain on the same run gives the same numbers.

    Example:
        >>> chain = ErrorChain(registration=RegistrationError(shift_mm=(0.5, 0.0, 0.0)))
        >>> ErrorChain.from_dict(chain.to_dict()) == chain, chain.empty
        (True, False)
    """

    registration: RegistrationError | None = None
    encoders: EncoderError | None = None
    servo: ServoLag | None = None
    compliance: Compliance | None = None
    head: HeadMotion | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        for name, kind in _STAGES.items():
            stage = getattr(self, name)
            if stage is not None and not isinstance(stage, kind):
                raise InputError(f"{name} of the error chain is a {type(stage).__name__}, not a {kind.__name__}")
        object.__setattr__(self, "seed", whole("the seed of the error chain", self.seed, 0, 2**63 - 1))

    @property
    def empty(self) -> bool:
        """Whether it has no stage."""
        return all(getattr(self, name) is None for name in _STAGES)

    @property
    def moves_joints(self) -> bool:
        """Whether a joint is not where its set point is."""
        return self.encoders is not None or self.servo is not None

    def for_free_hand(self) -> ErrorChain:
        """The stages that are left in a free hand, which has no robot: registration and head."""
        return replace(self, encoders=None, servo=None, compliance=None)

    @classmethod
    def papers(cls, fiducials: ArrayLike, seed: int = 0, about_mm: ArrayLike | None = None) -> Self:
        """The sizes of the system of Li 2004 and Li 2007; ``PAPERS`` says which of them are printed.

        fiducials: (n, 3) in LPS mm, by which the head is registered; about_mm: see ``RegistrationError.drawn``.
        """
        return cls(
            RegistrationError.drawn(fiducials, FLE_MM, seed, about_mm),
            EncoderError(noise_mm=0.005, noise_rad=2.5e-5, backlash_mm=0.2, backlash_rad=1e-3),
            ServoLag(1.0 / 30.0),
            Compliance(0.25, hand_weight_n=1.5),
            None,
            seed,
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; a stage that is off is None."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: Any) -> Self:
        """Inverse of ``to_dict``; a stage that is missing is off. Raises InputError."""
        if not isinstance(data, dict) or set(data) - set(_STAGES) - {"seed"}:
            raise InputError(f"an error chain has the keys {', '.join(_STAGES)} and seed; it is {data!r:.80}")
        stages = {name: _stage(name, kind, data.get(name)) for name, kind in _STAGES.items()}
        return cls(**stages, seed=data.get("seed", 0))

    @classmethod
    def read(cls, file: Path) -> Self:
        """Read a JSON file of the schema vfix-errors/1. Raises InputError."""
        try:
            if file.stat().st_size > LONGEST_FILE:
                raise InputError(f"the error chain {file.name} is larger than {LONGEST_FILE:,} bytes")
            data = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError) as error:
            raise InputError(f"the error chain {file.name} cannot be read: {error}") from error
        if not isinstance(data, dict) or data.pop("schema", None) != SCHEMA:
            raise InputError(f"{file.name} is no error chain of the schema {SCHEMA}")
        return cls.from_dict(data)


_STAGES: dict[str, type[Any]] = {
    "registration": RegistrationError,
    "encoders": EncoderError,
    "servo": ServoLag,
    "compliance": Compliance,
    "head": HeadMotion,
}


def _stage(name: str, kind: type[Any], values: Any) -> Any:
    """One stage of plain values."""
    if values is None:
        return None
    known = set(kind.__dataclass_fields__)
    if not isinstance(values, dict) or set(values) - known:
        raise InputError(f"{name} of the error chain has the keys {', '.join(sorted(known))}; it is {values!r:.80}")
    try:
        return kind(**values)
    except TypeError as error:
        raise InputError(f"{name} of the error chain: {error}") from None
