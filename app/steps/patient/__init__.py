"""Patient: which case is open, and how a new one comes in."""

from app.steps.patient.commands import COMMANDS
from app.steps.patient.sections import PatientSections
from app.steps.spec import StepSpec

SPEC = StepSpec("patient", "Patient", 10, __name__, "PatientStep", COMMANDS, PatientSections)
