"""Control: tasks, the quadratic program of a step, its certificate, and the explanation of the result.

One step: tasks and fixtures give objective and constraint rows, the distance pairs and joints add theirs
(``build_step``), the QP gives a joint step (``solve_step``), and the certificate accepts or refuses it
(``certify_step``).
The controller runs these three, tries a smaller step where one is refused, and names the limiting constraints.
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
