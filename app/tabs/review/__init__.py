"""Review: recorded runs of the open case, replayed, plotted and compared."""

from app.tabs.review.commands import COMMANDS
from app.tabs.review.sections import ReviewSections
from app.tabs.spec import TabSpec

SPEC = TabSpec(
    "review",
    "Review",
    40,
    __name__,
    "ReviewTab",
    COMMANDS,
    sections=ReviewSections,
    kinds=("head", "lumen"),
    needs="case",
    endoscope="offered",
)
