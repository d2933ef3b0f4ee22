"""The hint line of the Patient tab: what to do next, in one sentence."""

from __future__ import annotations


def patient_hint(case_open: bool, loading: bool) -> str:
    if loading:
        return "The head is being prepared."
    if not case_open:
        return "Choose a head, or import a CT."
    return "Drag to turn the head. Then go to Plan."
