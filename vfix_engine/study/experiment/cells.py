"""A cell of a paper's table beside ours, and the report of a study as JSON."""

from __future__ import annotations

import math
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
import scipy

from ...arrays import Array
from ..statistics import PairedTest

SCHEMA = "vfix-evidence/1"
Kind = Literal["fitted", "assumed", "predicted"]


@dataclass(frozen=True)
class Cell:
    """One printed figure and ours; None where the paper prints none, or there is none of ours.

    paper_sd: as printed after ±, of whatever it may be. sd_subjects: of ours, over subjects' means. n: subjects.
    kind: 'fitted' to this figure, 'assumed' where an assumption was chosen by it, else 'predicted'.
    note: what the reader must know.
    """

    table: str
    row: str
    column: str
    paper: float | None
    paper_sd: float | None
    ours: float | None
    sd_subjects: float | None
    kind: Kind
    n: int | None = None
    note: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; what is not finite is None."""
        return {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in asdict(self).items()
        }


def by_subject(values: Array) -> tuple[float, float | None]:
    """Mean and standard deviation over subjects of the means of their trials (subjects, trials); NaN is no trial."""
    with np.errstate(invalid="ignore"):
        means = np.array([one[~np.isnan(one)].mean() for one in values if not np.isnan(one).all()])
    if not len(means):
        return math.nan, None
    return float(means.mean()), float(means.std(ddof=1)) if len(means) > 1 else None


def report(
    study: str,
    seed: int,
    cells: list[Cell],
    *,
    quick: bool,
    fitted: Mapping[str, Any],
    assumed: Mapping[str, Any],
    order_share: Mapping[str, Any],
    pairs: Mapping[str, Mapping[str, PairedTest]],
    apparatus: int,
    more: Mapping[str, Any],
) -> dict[str, Any]:
    """The report of a study. pairs: by quantity, then by pair of modes; apparatus: its version."""
    versions = {"apparatus": apparatus, "numpy": np.__version__, "scipy": scipy.__version__}
    return {
        "schema": SCHEMA,
        "study": study,
        "seed": seed,
        "quick": quick,
        "versions": versions | {"python": platform.python_version()},
        "fitted": dict(fitted),
        "assumed": dict(assumed),
        "cells": [cell.to_dict() for cell in cells],
        "order_share": dict(order_share),
        "pairs": {name: {pair: one.to_dict() for pair, one in found.items()} for name, found in pairs.items()},
        **more,
    }
