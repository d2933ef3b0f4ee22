"""What people answer after a condition: NASA-TLX, six scales of workload."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from .file import StudyCondition

# Hart and Staveland 1988; each from 0 to 100 in steps of 5
SCALES = ("mental", "physical", "temporal", "performance", "effort", "frustration")
RAW = "nasa_tlx"  # the mean of the six, without weights ('raw TLX', Hart 2006)
UNIT = "of 100"
STEP = 5

Rating = Annotated[int, Meta(ge=0, le=100, multiple_of=STEP)]
Ratings = tuple[Rating, Rating, Rating, Rating, Rating, Rating]


class AnsweredTlx(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The answers of a subject after a condition. ratings: in the order of `SCALES`."""

    schema: Literal["vfix-study-answer/1"]
    subject: str
    case: str
    plan: str
    mode: str
    arm: str
    tool: str
    ratings: Ratings

    @classmethod
    def of(cls, subject: str, condition: StudyCondition, ratings: Ratings) -> AnsweredTlx:
        """The answers after a condition."""
        return cls("vfix-study-answer/1", subject, *condition, ratings)

    @property
    def condition(self) -> StudyCondition:
        """After which condition."""
        return StudyCondition(self.case, self.plan, self.mode, self.arm, self.tool)  # type: ignore[arg-type]

    @property
    def values(self) -> dict[str, float]:
        """The raw index and the six scales, by their name in results."""
        scales = {f"{RAW}_{name}": float(rating) for name, rating in zip(SCALES, self.ratings, strict=True)}
        return {RAW: math.fsum(self.ratings) / len(self.ratings)} | scales
