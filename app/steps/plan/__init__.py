"""Plan: points, targets and the path, and what the tool makes of it."""

from app.steps.plan.commands import COMMANDS
from app.steps.plan.sections import PlanSections
from app.steps.plan.suggest_commands import COMMANDS as SUGGEST_COMMANDS
from app.steps.spec import StepSpec

SPEC = StepSpec("plan", "Plan", 20, __name__, "PlanStep", (*COMMANDS, *SUGGEST_COMMANDS), PlanSections, input="edit")
