"""The margin and the robot's base in the Plan tab: set, kept, taken back."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest
from session_doubles import SAMPLE, open_sample, sections_of, send

from app.planning.plan_evaluation import PlanEvaluation
from app.plans.operations.document import RedoPlan, UndoPlan
from app.plans.service import Plan
from app.services import Services
from app.tabs.plan.dry_runs import ShownEvaluation
from vfix_engine.errors import InputError, PlanError

BASE = np.array([[0.0, -1.0, 0.0, 40.0], [1.0, 0.0, 0.0, -300.0], [0.0, 0.0, 1.0, 25.0], [0.0, 0.0, 0.0, 1.0]])
Q_START = np.array([0.0, 1.0, -20.0, 0.5, 0.0, -0.2, 3.0])


@pytest.fixture
def plan(phantom_services: Services) -> Iterator[Plan]:
    made = phantom_services.plans.documents.duplicate(SAMPLE, "Margin and base")
    yield made
    phantom_services.plans.documents.delete(made.id)


def test_the_margin_is_set_within_its_bounds_and_is_no_step_of_the_history(
    phantom_services: Services, plan: Plan
) -> None:
    step = open_sample(phantom_services, plan.id)
    low, high = sections_of(step)["instruments"]["margin_bounds_mm"]
    assert sections_of(step)["plan"]["margin_mm"] == 0.3
    send(step, "plan.settings", settings={"margin_mm": 0.45})
    shown = sections_of(step)["plan"]
    assert (shown["margin_mm"], shown["can_undo"]) == (0.45, False)
    for wrong in (low / 2.0, high * 2.0):
        with pytest.raises(InputError, match="Safety margin"):
            send(step, "plan.settings", settings={"margin_mm": wrong})
    assert sections_of(step)["plan"]["margin_mm"] == 0.45


def test_the_base_of_the_simulation_is_kept_and_left_to_it_again(
    phantom_services: Services, plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = open_sample(phantom_services, plan.id)
    for running in (ShownEvaluation("computing"), ShownEvaluation("done", evaluation=found(), provisional=True)):
        monkeypatch.setattr(step._evaluations, "shown", lambda edited, running=running: running)
        with pytest.raises(PlanError, match="once the simulation has ended"):
            send(step, "base.keep")
    with pytest.raises(PlanError, match="keeps no placing"):
        send(step, "base.free")

    monkeypatch.setattr(step._evaluations, "shown", lambda edited: ShownEvaluation("done", evaluation=found()))
    send(step, "base.keep")
    kept = phantom_services.plans.get(plan.id).content.robot
    assert (kept["name"], kept["base"], kept["q_start"]) == ("steady_hand", BASE.ravel().tolist(), Q_START.tolist())
    assert step._edited is not None
    assert step._edited.section().build()["robot"]["is_placed"] is True
    assert step._edited.perform(UndoPlan()) == "Undone: The robot’s base is kept."
    step._edited.perform(RedoPlan())
    send(step, "base.free")
    assert step._edited.section().build()["robot"]["is_placed"] is False
    assert step._edited.perform(UndoPlan()) == "Undone: The robot’s base is placed automatically."
    assert phantom_services.plans.get(plan.id).content.robot == kept


def found() -> PlanEvaluation:
    """What a simulation found, as far as the base is concerned."""
    return SimpleNamespace(base=BASE, q_start=Q_START, registered=None)  # type: ignore[return-value]
