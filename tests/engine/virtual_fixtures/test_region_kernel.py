"""How deep a tool is in a soft region, against places sampled densely along its axes; starts are refused in words."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.fixture_states import TOOL, anywhere, state_at
from vfix_engine.errors import StartRefused
from vfix_engine.proximity.fields.distance_field import DistanceField, FieldGrid, field_of_level
from vfix_engine.virtual_fixtures import DeeperPlace, SoftRegion, StepState
from vfix_engine.virtual_fixtures.region_kernel import LEAST_ADVANCE_MM, STEEPEST, keeps_depth, largest_excess
from vfix_engine.virtual_fixtures.soft_region import ERROR_STEPS, RESERVE_MM

BETWEEN_PLACES_MM = 0.5 * STEEPEST * LEAST_ADVANCE_MM


def gland(state: StepState, random: np.random.Generator) -> DistanceField:
    """A ball beside the tool's tip, on a fine grid within a coarse one that reaches further."""
    tip = state.tip.position
    centre, radius = tip + random.normal(scale=4.0, size=3), random.uniform(4.0, 8.0)

    def level(places: np.ndarray) -> np.ndarray:
        return radius - np.linalg.norm(places - centre, axis=1)

    fine, coarse = (
        field_of_level(level, np.stack([tip - reach, tip + reach]), step).grids[0]
        for reach, step in ((7.0, 0.5), (16.0, 1.0))
    )
    return DistanceField([fine, coarse])


def error_mm(grids: tuple[FieldGrid, ...], places: np.ndarray) -> np.ndarray:
    """That of the first grid that knows each place."""
    low, high = grids[0].bounds
    fine = ((places >= low) & (places <= high)).all(axis=1)
    return ERROR_STEPS * np.where(fine, grids[0].step_mm, grids[1].step_mm)


def dense_excess(region: SoftRegion, start: np.ndarray, end: np.ndarray) -> float:
    """The largest excess of places 0.01 mm apart."""
    worst = -np.inf
    for a, b, radius in zip(start, end, TOOL.radius, strict=True):
        places = a + np.linspace(0.0, 1.0, int(np.linalg.norm(b - a) / 0.01) + 2)[:, None] * (b - a)
        allowed = np.array([region.allowed_mm(place) for place in places])
        depth = region.layer_mm + radius - region.field.at(places)
        excess = depth + error_mm(tuple(region.field.grids), places) - allowed
        worst = max(worst, float(np.nanmax(excess, initial=-np.inf)))
    return worst


@pytest.mark.parametrize("seed", range(12))
def test_the_largest_excess_is_that_of_places_sampled_densely(seed: int) -> None:
    random = np.random.default_rng(seed)
    state = state_at(anywhere(random))
    deeper = DeeperPlace(state.tip.position + random.normal(size=3), 2.0, 6.0) if seed % 2 else None
    region = SoftRegion("gland", gland(state, random), 0.5, 2.0, deeper)
    found, dense = region.excess(state), dense_excess(region, state.segments.start, state.segments.end)
    assert dense > -20.0
    assert dense - BETWEEN_PLACES_MM - 1e-3 <= found <= dense + 0.02


@pytest.mark.parametrize("seed", range(40))
def test_a_start_is_refused_in_words_however_little_it_is_too_deep(seed: int) -> None:
    """Where the coarse grid's error alone makes it too deep, the tool may not touch the region at all."""
    random = np.random.default_rng(100 + seed)
    state = state_at(anywhere(random))
    tip, away = state.tip.position, random.normal(size=3)
    away /= np.linalg.norm(away)
    elsewhere = FieldGrid(np.full((5, 5, 5), 20.0, np.float32), tip + 30.0, 0.5)
    box = tip + np.array([[-16.0], [16.0]])
    centre = tip + 9.0 * away

    def gland_of(radius: float, allowed: float) -> SoftRegion:
        near = field_of_level(lambda places: radius - np.linalg.norm(places - centre, axis=1), box, 1.0)
        return SoftRegion("gland", DistanceField([elsewhere, *near.grids]), 0.5, allowed)

    radius = 4.85 - gland_of(5.0, 0.85).excess(state)
    allowed = 0.85 + gland_of(radius, 0.85).excess(state) + RESERVE_MM
    over = 10.0 ** random.uniform(-6.0, -2.0)  # mm
    with pytest.raises(StartRefused, match=r"mm deep in gland"):
        gland_of(radius, allowed - over).refuse_start(state, TOOL.segment_names)
    gland_of(radius, allowed + 1e-9).refuse_start(state, TOOL.segment_names)


def test_the_refusal_names_the_part_and_its_depth() -> None:
    state = state_at(np.zeros(7))
    tip = state.tip.position
    box = np.stack([tip - 12.0, tip + 12.0])
    around_tip = field_of_level(lambda places: 6.0 - np.linalg.norm(places - tip, axis=1), box, 0.5)
    depth = 6.0 + TOOL.radius[0]
    with pytest.raises(StartRefused, match=rf"the {TOOL.segment_names[0]} would start {depth:.1f} mm deep"):
        SoftRegion("gland", around_tip, 0.5, 2.0).refuse_start(state, TOOL.segment_names)


@pytest.mark.parametrize("seed", range(8))
def test_a_motion_that_is_kept_is_nowhere_too_deep(seed: int) -> None:
    """Against 40 poses of the straight motion; and a motion is not refused where there is room."""
    random = np.random.default_rng(200 + seed)
    q = anywhere(random)
    state = state_at(q)
    field = gland(state, random)
    region = SoftRegion("gland", field, 0.5, max(SoftRegion("gland", field, 0.5, 2.0).excess(state) + 2.0, 1.0) + 0.4)
    grids, one, kept = field.grids, state.segments, 0
    for _ in range(40):
        two = state_at(q + random.normal(scale=2e-3, size=7)).segments
        if not keeps_depth(
            grids[0].values, grids[1].values, region.numbers, one.start, one.end, one.radius, two.start, two.end,
            0.0, -RESERVE_MM, 0.07, 64,
        ):  # fmt: skip
            worst = max(dense_excess(region, one.start, one.end), dense_excess(region, two.start, two.end))
            assert worst > -RESERVE_MM - STEEPEST * 1.0
            continue
        kept += 1
        for share in (0.25, 0.5, 0.75, 1.0):
            start, end = one.start + share * (two.start - one.start), one.end + share * (two.end - one.end)
            assert dense_excess(region, start, end) <= -RESERVE_MM + 0.07 + BETWEEN_PLACES_MM + 1e-3
    assert kept > 0


def test_the_floor_is_told_where_the_tool_is_nowhere_near() -> None:
    state = state_at(np.zeros(7))
    at, tip = state.segments, state.tip.position
    box = tip + np.array([[95.0], [105.0]])
    far = field_of_level(lambda places: 2.0 - np.linalg.norm(places - tip - 100.0, axis=1), box, 1.0)
    region = SoftRegion("gland", far, 0.5, 3.0)
    values = far.grids[0].values
    found = largest_excess(values, values, region.numbers, at.start, at.end, at.radius, 0.0, at.start, at.end, -50.0)
    assert found == (-50.0, -1, 0.0)
