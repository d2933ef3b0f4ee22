"""Cones on the targets: of the stored path, drawn on the selected target, greyed while they are of another one."""

from __future__ import annotations

import numpy as np
from session_doubles import SAMPLE, Later, open_sample, sections_of

from app.kit.kept import Same
from app.scene.cones import cone_edges
from app.services import Services
from app.tabs.plan import commands as c
from app.tabs.plan.cones import Cones, cone_words
from app.tabs.plan.dry_runs import ShownEvaluation
from app.tabs.plan.edited_plan import EditedPlan
from app.workspace.latest import Act
from vfix_engine.worlds.rigid.cone_surface import cone_surface


def test_the_cones_of_the_page_are_those_that_evaluate_tells(phantom_services: Services) -> None:
    plan = phantom_services.plans.documents.duplicate(SAMPLE, "Cones")
    edited, executor, ran = EditedPlan(phantom_services, plan.id), Later(), list[Act]()
    cones = Cones(phantom_services, executor, ran.append)
    cones.refresh(edited, ShownEvaluation("computing"))
    assert cones.section(edited).build()["state"] == "none"
    known = ShownEvaluation("done", evaluation=phantom_services.planning.evaluate(plan))
    cones.refresh(edited, known)
    cones.refresh(edited, known)
    assert len(executor.work) == 1
    executor.work.pop()()
    ran.pop()()
    section = cones.section(edited).build()
    assert section["state"] == "current"
    told = phantom_services.path_evaluations.of_plan(plan).chosen.targets
    assert [(one["target"], one["cone_deg"]) for one in section["items"]] == [(t.target, t.cone_deg) for t in told]
    assert all(one["words"].startswith(("Can be seen within a cone of", "Cannot be seen")) for one in section["items"])
    # Under a hand, and until the dry run of the released path is there, they are greyed.
    target = plan.content.targets[0]
    edited.drag(target.id, target.position)
    assert cones.section(edited).build()["state"] == "waits"
    edited.let_go()
    cones.refresh(edited, ShownEvaluation("computing"))
    assert cones.section(edited).build()["state"] == "waits"
    cones.refresh(edited, ShownEvaluation("failed"))
    assert cones.section(edited).build()["state"] == "none"
    phantom_services.plans.documents.delete(plan.id)


def test_the_selected_target_alone_has_its_cone_drawn(phantom_services: Services) -> None:
    step = open_sample(phantom_services)
    plan = phantom_services.plans.get(SAMPLE)
    found = phantom_services.planning.cones(plan)
    sections_of(step)
    cones, target = step._evaluations.cones, plan.content.targets[0]
    cones._show({t.id: (t.position, found[t.id]) for t in plan.content.targets})
    step.handle(c.ItemCommand(type="item.select", item_id=plan.content.points[0].id))
    assert cones.layer(step._edited).key is None
    step.handle(c.ItemCommand(type="item.select", item_id=target.id))
    assert cones.layer(step._edited).key == (target.position, Same(found[target.id]), False)
    assert "°" in cone_words(found[target.id])


def test_the_edges_of_a_cone_are_its_rim_and_some_lines_to_the_target(phantom_services: Services) -> None:
    plan = phantom_services.plans.get(SAMPLE)
    found = phantom_services.planning.cones(plan)
    target = max(plan.content.targets, key=lambda one: found[one.id].cone_deg)
    vertices, faces = cone_surface(found[target.id], target.position, 30.0)
    edges = cone_edges(vertices, faces)
    away = np.linalg.norm(edges - np.array(target.position), axis=2)
    from_target = np.isclose(away[:, 0], 0.0, atol=1e-3)
    assert np.allclose(away[:, 1], 30.0, atol=1e-3)
    assert 1 <= from_target.sum() <= 8
    ends, count = np.unique(edges[~from_target].reshape(-1, 3), axis=0, return_counts=True)
    assert len(ends)
    assert (count % 2 == 0).all(), "the rim is closed"
