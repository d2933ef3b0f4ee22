"""Snapshots of a tool that rehearses a plan: on a robot, or in a free hand."""

from __future__ import annotations

from vfix_engine.worlds.freehand.snapshot import FreehandSnapshot
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot

ToolSnapshot = RigidSnapshot | FreehandSnapshot
