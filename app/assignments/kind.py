"""How assignments are stored."""

from __future__ import annotations

from app.assignments.content import Assignment, with_rules
from app.assignments.file import SCHEMA
from app.documents import struct_kind

ASSIGNMENT = struct_kind(name="assignment", noun="assignment", schema=SCHEMA, content=Assignment, rules=with_rules)
