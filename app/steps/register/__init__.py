"""Register: how the image lies on the patient, found by points that are seen in the CT and measured at the patient."""

from app.steps.register.commands import COMMANDS
from app.steps.register.sections import RegisterSections
from app.steps.spec import StepSpec

SPEC = StepSpec("register", "Register", 25, __name__, "RegisterStep", COMMANDS, RegisterSections)
