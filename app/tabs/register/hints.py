"""The hint line of the Register tab: what to do next, in one sentence."""

from __future__ import annotations

from app.registration.document import RegistrationContent
from app.registration.fit_report import FitReport


def register_hint(
    content: RegistrationContent | None, report: FitReport | None, used: bool, deleted: bool = False, blocked: str = ""
) -> str:
    """content: of the open registration; used: the open plan uses it; deleted: by somebody else.

    blocked: why the open plan cannot use what it refers to, where that is no open registration.
    """
    if deleted:
        return "Deleted. Restore it, or open another one."
    if blocked and (content is None or report is None or report.usable):
        return blocked
    if content is None or report is None:
        return "Begin a registration."
    confirmed = {pair.bead for pair in content.pairs}
    waiting = [bead for bead in content.beads if not bead.rejected and bead.id not in confirmed]
    if not content.pairs and not content.beads and content.made_from not in ("given", "surface"):
        return "Find beads, or add points."
    if waiting and not any(pair.measured for pair in content.pairs):
        return "Confirm beads on the skin, reject the others."
    if any(pair.in_image is not None and pair.measured is None for pair in content.pairs) and not report.usable:
        return "Measure each point, or simulate."
    if report.wrong is not None and report.wrong.certainty == "outlier":  # one good set in four has a suspect
        return report.wrong.words
    if not report.usable:
        return report.words
    if report.few:
        return report.few
    if report.state == "refined" and not used:
        return "Check the points that took no part; then ‘Use for plan’."
    if report.fle_source == "none" and not used:
        return "Add points to see the error, or ‘Use for plan’."
    if not used:
        return "Check the error, then ‘Use for plan’."
    if report.state == "refined" or report.fle_source == "none":
        return "In use, error unknown. Go to Plan."
    return "In use. Go to Plan."
