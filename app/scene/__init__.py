"""The three-dimensional scene: snapshots of the planner drawn as viser nodes, one set per browser tab.

Nodes are created once and then their properties assigned; nothing here decides anything.
Everything is in the patient frame (LPS, mm).
"""

from app.scene.view import SceneView

__all__ = ["SceneView"]
