"""Sentences on what a place lies in."""

from __future__ import annotations

from vfix_engine.anatomy.soft_tissue import TissueKind

# A sentence about a place that is offered; '' for one in the air inside the body.
PLACE_WORDS: dict[TissueKind, str] = {
    "air_inside": "",
    "soft_tissue": "The place lies in soft tissue, not in the airway.",
    "outside_body": "The place lies outside the body.",
    "outside_scan": "The place lies outside the scan; whether it is air is not known.",
    "not_known": "Without a CT it is not known whether the place is air.",
}
