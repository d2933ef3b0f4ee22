"""Review: recorded runs of the open head, replayed, plotted and compared."""

from app.tabs.spec import TabSpec

SPEC = TabSpec(
    "review", "Review", 40, __name__, "ReviewTab", kinds=("head",), needs="case", endoscope="offered"
)  # fmt: skip
