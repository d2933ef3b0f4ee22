"""Tables and figures of docs/evidence.md are those of the stored reports, which are complete."""

import json
from pathlib import Path

import pytest

from scripts import evidence, evidence_figures, evidence_kwok
from vfix_engine.study.experiment.fit import Fitted
from vfix_engine.study.experiment.kwok_figures import KWOK_III, KWOK_IV
from vfix_engine.study.experiment.paper_figures import LI_2004, LI_2007

DOCS = Path(__file__).resolve().parent.parent / "docs"


def test_the_tables_are_those_of_the_reports() -> None:
    page = (DOCS / "evidence.md").read_text(encoding="utf-8")
    assert evidence.written(page) == page
    assert page.count("<!-- cells of") == 4


@pytest.mark.parametrize(("study", "printed"), [("li2004", LI_2004), ("li2007", LI_2007)])
def test_a_report_has_the_printed_figures_and_the_stored_fit(study: str, printed: dict[str, object]) -> None:
    report = json.loads((DOCS / "evidence" / f"{study}.json").read_text(encoding="utf-8"))
    named = {(cell["table"], cell["row"], cell["column"]): cell for cell in report["cells"]}
    for one in printed.values():
        cell = named[one.table, one.row, one.column]  # type: ignore[attr-defined]
        assert (cell["paper"], cell["paper_sd"]) == (one.value, one.sd)  # type: ignore[attr-defined]
    assert report["fitted"] == Fitted.stored().to_dict()
    assert not [cell for cell in report["cells"] if cell["ours"] is None]


@pytest.mark.parametrize("changed", [file.stem for file in sorted((DOCS / "evidence").glob("*.json"))])
def test_a_changed_report_changes_the_page(changed: str, tmp_path: Path) -> None:
    page = (DOCS / "evidence.md").read_text(encoding="utf-8")
    for file in (DOCS / "evidence").glob("*.json"):
        report = json.loads(file.read_text(encoding="utf-8"))
        if file.stem == changed:
            report["cells"][0]["ours"] += 50.0  # more than three digits hide
            for one in report.get("sweeps", {}) if changed == "li2007-full" else ():
                report["sweeps"][one]["rows"][0]["hands-on error_mm"] += 0.5
        (tmp_path / file.name).write_text(json.dumps(report), encoding="utf-8")
    assert evidence.written(page, tmp_path) != page


def test_a_full_run_gives_its_tables_where_it_is_stored(tmp_path: Path) -> None:
    for file in (DOCS / "evidence").glob("*.json"):
        if not file.stem.endswith(evidence.FULL):
            (tmp_path / file.name).write_bytes(file.read_bytes())
    page = (DOCS / "evidence.md").read_text(encoding="utf-8")
    assert evidence.written(page, tmp_path).count("No full run is stored") == 9
    arms = {"manual": {"time_s": 3.0}, "guided": {"time_s": None}}
    sweeps = [
        {"assumption": name, "value": value, "subjects": 2, "arms": arms}
        for name, value in (("as assumed", None), ("content", 0.35))
    ]
    for study in ("kwok2013-1", "kwok2013-2"):
        report = json.loads((tmp_path / f"{study}.json").read_text(encoding="utf-8")) | {"sweeps": sweeps}
        (tmp_path / f"{study}{evidence.FULL}.json").write_text(json.dumps(report), encoding="utf-8")
    rows = [
        {"value": value, "is_assumed": value == 0.1, "inspection_mm": 0.4, "order_share": 0.7}
        | {f"{mode} error_mm": 1.0 + value for mode in evidence.SWEPT}
        | {f"{mode} time_s": 20.0 for mode in evidence.SWEPT}
        for value in (0.0, 0.1)
    ]
    report = json.loads((tmp_path / "li2007.json").read_text(encoding="utf-8"))
    report["sweeps"] = {"compliance_mm_per_n": {"what": "compliance, mm/N", "rows": rows}}
    (tmp_path / f"li2007{evidence.FULL}.json").write_text(json.dumps(report), encoding="utf-8")
    found = evidence.written(page, tmp_path)
    assert "No full run is stored" not in found
    assert "| compliance, mm/N | 0, **0.1** | 1.00, 1.10 | 1.00, 1.10 | 1.00, 1.10 | 20.0 | 20.0 | 20.0 |" in found
    assert found.count("| `content` | 0.35 | 3 / none |") == 2
    assert found.count("| Complet. Time (s) | 333.8 ± 94.78 / **520 ± 38.6** |") == 1
    assert found.count("| Compl. Time (s) | 21.4 ± 9.17 / **") == 1


@pytest.mark.parametrize(
    ("study", "mode", "changed"), [("li2004", "hands-on", "li2004_6.svg"), ("li2007", "freehand", "li2007_15.svg")]
)
def test_the_figures_are_those_of_the_report_and_all_are_shown(study: str, mode: str, changed: str) -> None:
    report = json.loads((DOCS / "evidence" / f"{study}.json").read_text(encoding="utf-8"))
    page = (DOCS / "evidence.md").read_text(encoding="utf-8")
    drawn = evidence_figures.drawn(report)
    assert {file.name for file in (DOCS / "evidence").glob(f"{study}_*.svg")} == set(drawn)
    for name, text in drawn.items():
        assert (DOCS / "evidence" / name).read_text(encoding="utf-8") == text, name
        assert f"(evidence/{name})" in page
    report["traces"]["trials"][mode]["seen_error_mm"][3] += 0.5
    assert {name for name, text in evidence_figures.drawn(report).items() if text != drawn[name]} == {changed}


@pytest.mark.parametrize(
    ("study", "printed"),
    [
        ("kwok2013-1", [one for row in KWOK_III.values() for one in row]),
        ("kwok2013-2", [one for row in KWOK_IV.values() for one in row]),
    ],
)
def test_a_report_of_kwok_2013_has_the_printed_figures(study: str, printed: list[object]) -> None:
    report = json.loads((DOCS / "evidence" / f"{study}.json").read_text(encoding="utf-8"))
    named = {(cell["table"], cell["row"], cell["column"]): cell for cell in report["cells"]}
    for one in printed:
        cell = named[one.table, one.row, one.column]  # type: ignore[attr-defined]
        assert (cell["paper"], cell["paper_sd"]) == (one.value, one.sd)  # type: ignore[attr-defined]
        assert cell["n"] <= report["subjects"]
    assert report["fitted"] == {}
    assert report["schema"] == "vfix-evidence/1"


def test_the_figure_of_kwok_2013_is_that_of_its_report() -> None:
    report = json.loads((DOCS / "evidence" / "kwok2013-1.json").read_text(encoding="utf-8"))
    drawn = evidence_kwok.drawn(report)
    for name, text in drawn.items():
        assert (DOCS / "evidence" / name).read_text(encoding="utf-8") == text
        assert f"(evidence/{name})" in (DOCS / "evidence.md").read_text(encoding="utf-8")
    next(cell for cell in report["cells"] if cell["column"] == "with DAC")["ours"] *= 0.5
    assert evidence_kwok.drawn(report) != drawn


def test_the_report_beyond_the_papers_is_of_both_anatomies_that_travel_and_keeps_the_margin() -> None:
    report = json.loads((DOCS / "evidence" / "li2007-beyond.json").read_text(encoding="utf-8"))
    assert {cell["kind"] for cell in report["cells"]} == {"predicted"}
    assert {"phantom", "mirrored"} <= {cell["table"] for cell in report["cells"]}
    assert report["fitted"] == Fitted.stored().to_dict()
    kept = [
        cell["ours"]
        for cell in report["cells"]
        if cell["column"] == "least distance to bone mm" and cell["row"] != "freehand"
    ]
    assert min(kept) >= report["margins_mm"]["bone"] - 1e-6
