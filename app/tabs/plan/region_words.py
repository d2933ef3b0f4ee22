"""Regions of a plan in words."""

from __future__ import annotations

from app.cases.structures import within_a_sentence
from app.plans.shapes import size_of
from app.plans.zones import PlanZone, RemovedBone
from app.tabs.plan.side_words import half_space_words

KIND_WORDS = {
    "sphere": "Sphere",
    "capsule": "Capsule",
    "capsules": "Chain",
    "box": "Box",
    "half_space": "Half-space",
    "patch": "Patch of bone",
    "structure": "Structure of the case",
}
DRAW_WORDS = {
    "sphere": "Click the sphere’s centre.",
    "capsules": "Click along the structure, end to end. Enter ends it, Esc takes it back.",
    "capsule": "Click the two ends of the capsule.",
    "box": "Click the middle of the box.",
    "half_space": "Click a place on the plane. The tool stays on the side that is chosen.",
    "patch": "Click the bone, mid-patch.",
}


def zone_words(region: PlanZone | RemovedBone) -> str:
    """Shape and firmness, such as 'Sphere, radius 4.0 mm · hard, margin 1.0 mm'."""
    shape, sizes = region.shape, size_of(region.shape)
    words = KIND_WORDS[shape["kind"]]
    if shape["kind"] == "half_space":
        words += f": {within_a_sentence(half_space_words(shape['point'], shape['normal']))}"
    if len(sizes) == 1:
        words += f", radius {sizes[0]:.1f} mm"
    elif sizes:
        words += f", {' × '.join(f'{2.0 * half:.1f}' for half in sizes)} mm"
    if isinstance(region, RemovedBone):
        return words
    if region.kind == "hard":
        return f"{words} · hard, margin {region.margin_mm:.1f} mm"
    deep = "" if region.max_depth_mm is None else f", {region.max_depth_mm:.1f} mm deep at most"
    return f"{words} · soft, {region.stiffness_n_per_mm:g} N/mm{deep}"
