"""The hint line of the Patient tab: what to do next, in one sentence."""

from __future__ import annotations

from app.cases.kinds import KindSpec


def patient_hint(kind: KindSpec | None, loading: bool) -> str:
    """kind: of the open case; None where none is open."""
    if loading:
        return f"The {'case' if kind is None else kind.noun} is being prepared."
    if kind is None:
        return "Choose a case, or import one."
    return f"Drag to turn the {kind.noun}. Then go to {kind.then}."
