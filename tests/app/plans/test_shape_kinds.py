"""Each kind of shape is known wherever shapes are told apart: a kind that one of these places forgets fails here."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from session_doubles import HEAD

from app.exchange.regions import region_markups
from app.planning.shape_meshes import NOTHING, shape_mesh
from app.plans.model import PlanContent
from app.plans.shapes import SHAPE_KINDS, anchor, check_shape, moved, solids
from app.plans.zones import PlanZone
from app.services import Services
from app.tabs.plan.region_words import DRAW_WORDS, zone_words

FILE = Path(__file__).resolve().parents[2] / "web" / "region-shapes.json"
EXAMPLES: dict[str, dict[str, Any]] = json.loads(FILE.read_text(encoding="utf-8"))
OF_THE_CASE = {"structure"}  # a mesh that stays where it is
ON_A_SURFACE = {"patch"}


def test_every_kind_has_an_example() -> None:
    """The page's tests draw the same ones on slices."""
    assert set(EXAMPLES) == set(SHAPE_KINDS)


@pytest.mark.parametrize("kind", SHAPE_KINDS)
def test_a_kind_is_known_everywhere(phantom_services: Services, kind: str) -> None:
    shape = check_shape(EXAMPLES[kind])
    assert bool(solids(shape)) == (kind not in OF_THE_CASE | ON_A_SURFACE)
    place = anchor(shape)
    assert (place is None) == (kind in OF_THE_CASE)
    if place is not None:
        x, y, z = place
        there = moved(shape, (x + 1.0, y + 2.0, z + 3.0))
        assert anchor(there) == pytest.approx((x + 1.0, y + 2.0, z + 3.0))
        assert check_shape(there) == there
        assert DRAW_WORDS[kind].endswith(".")
    zone = PlanZone("z", "Eye", shape)
    assert zone_words(zone)
    vertices, faces = shape_mesh(phantom_services.cases, HEAD, shape)
    assert len(faces) > len(NOTHING[1])
    assert len(vertices) > len(NOTHING[0])
    plan = phantom_services.plans.create(HEAD, "Shapes", PlanContent(zones=(zone,)))
    content = phantom_services.plans.get(plan.id).content
    marked = region_markups(content.zones, content.removed_bone)
    assert bool(marked) == (kind not in OF_THE_CASE)
    phantom_services.plans.documents.delete(plan.id)
