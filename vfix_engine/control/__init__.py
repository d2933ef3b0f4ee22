"""Control: admittance law, one QP, certificate, explanation.

One step: the task gives rows, the boundary adds its own, the QP gives a joint step, the certificate takes, shrinks or
holds it, and the explanation names what held it.
"""

from ..fixtures import ToolState
from .controller import Controller
from .explain import Blocker
from .settings import Bound, ControlSettings
from .task import StepReport, Task

__all__ = ["Blocker", "Bound", "ControlSettings", "Controller", "StepReport", "Task", "ToolState"]
