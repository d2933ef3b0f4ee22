"""Plan: points, targets and the path, and what the tool makes of it."""

from app.tabs.plan.commands import COMMANDS
from app.tabs.plan.sections import PlanSections
from app.tabs.plan.suggest_commands import COMMANDS as SUGGEST_COMMANDS
from app.tabs.spec import TabSpec

ALL = (*COMMANDS, *SUGGEST_COMMANDS)
SPEC = TabSpec(
    "plan",
    "Plan",
    20,
    __name__,
    "PlanTab",
    ALL,
    PlanSections,
    input="edit",
    documents=("plan",),
    kinds=("head",),
    needs="case",
)
