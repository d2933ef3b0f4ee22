"""Patient: the open case, and the import of new ones."""

from app.tabs.patient.commands import COMMANDS
from app.tabs.patient.sections import PatientSections
from app.tabs.spec import TabSpec

SPEC = TabSpec("patient", "Patient", 10, __name__, "PatientTab", COMMANDS, PatientSections)
