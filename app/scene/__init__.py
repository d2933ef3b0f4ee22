"""The three-dimensional scene: snapshots of the planner drawn as viser nodes, one set per browser tab.

Nodes are created once, afterwards only their properties are assigned. This package draws and makes no decisions.
All coordinates are in the patient frame (LPS, mm).
"""

from app.scene.view import SceneView

__all__ = ["SceneView"]
