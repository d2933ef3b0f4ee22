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
        return "This registration is deleted. Restore it above, or open another one."
    if blocked and (content is None or report is None or report.usable):
        return blocked
    if content is None or report is None:
        return "Begin a registration: it says how the CT lies on the patient."
    confirmed = {pair.bead for pair in content.pairs}
    waiting = [bead for bead in content.beads if not bead.rejected and bead.id not in confirmed]
    if not content.pairs and not content.beads and content.made_from not in ("given", "surface"):
        return "Press ‘Find beads’, or add points at the crosshair."
    if waiting and not any(pair.measured for pair in content.pairs):
        return "Look at each bead in the slices: confirm those that lie on the skin, reject the others."
    if any(pair.in_image is not None and pair.measured is None for pair in content.pairs) and not report.usable:
        return "Touch each point with the pointer, type where it was measured, or read a table."
    if report.wrong is not None and report.wrong.certainty == "outlier":  # one good set in four has a suspect
        return report.wrong.words
    if not report.usable:
        return report.words
    if report.few:
        return report.few
    if report.state == "refined" and not used:
        return "Look how far off the points are that took no part; then press ‘Use for this plan’."
    if report.fle_source == "none" and not used:
        return "Nothing is known of the error. Add points to see how far they are off; then press ‘Use for this plan’."
    if not used:
        return "Read the error at the targets; then press ‘Use for this plan’."
    if report.state == "refined" or report.fle_source == "none":
        return "The plan uses this registration. How far it may be off is not known; Plan says what that means."
    return "The plan uses this registration. Go on to Plan: its verdict says what the error means for the tool."
