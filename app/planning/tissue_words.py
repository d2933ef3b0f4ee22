"""Sentences on what a place lies in."""

from __future__ import annotations

from vfix_engine.anatomy.soft_tissue import TissueKind

# A sentence about a place that is offered; '' for one in the air inside the body.
PLACE_WORDS: dict[TissueKind, str] = {
    "air_inside": "",
    "soft_tissue": "In soft tissue, not in air.",
    "outside_body": "Outside the body.",
    "outside_scan": "Outside the scan.",
    "not_known": "No CT: air is not known.",
}
