"""Patient: which case is open, and how a new one comes in."""

from app.tabs.patient.commands import COMMANDS
from app.tabs.patient.sections import PatientSections
from app.tabs.spec import TabSpec

SPEC = TabSpec("patient", "Patient", 10, __name__, "PatientTab", COMMANDS, PatientSections)
