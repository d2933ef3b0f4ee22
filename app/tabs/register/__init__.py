"""Register: how the image lies on the patient, found by points that are seen in the CT and measured at the patient."""

from app.tabs.register.commands import COMMANDS
from app.tabs.register.sections import RegisterSections
from app.tabs.spec import TabSpec

SPEC = TabSpec(
    "register", "Register", 25, __name__, "RegisterTab", COMMANDS, RegisterSections,
    documents=("registration",), kinds=("head",),
)  # fmt: skip
