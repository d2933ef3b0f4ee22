"""Control: tasks, one QP, certificate, explanation.

One step: the tasks and fixtures give rows, the boundary adds its own (``build_step``), the QP gives a joint step
(``solve_step``), and the certificate takes or refuses it (``certify_step``).
The controller does these three, tries less where a step is refused, and names what held it.
"""

from ..virtual_fixtures import StepState
from .blockers import LimitingConstraint
from .context import ControlContext
from .controller import Controller
from .problem import Problem, Row
from .program import Solution
from .settings import Bound, ControlSettings
from .step import Certified, Refused, build_step, certify_step, solve_step
from .step_report import StepReport
from .step_request import HandCommand, StepRequest, Task

__all__ = [
    "Bound",
    "Certified",
    "ControlContext",
    "ControlSettings",
    "Controller",
    "HandCommand",
    "LimitingConstraint",
    "Problem",
    "Refused",
    "Row",
    "Solution",
    "StepReport",
    "StepRequest",
    "StepState",
    "Task",
    "build_step",
    "certify_step",
    "solve_step",
]
