"""Make the pictures of the docs: the real page in Chromium, with the shipped head.

    python scripts/make_pictures.py [--out DIR] [--only head|colon]

Needs the test tools (`python3 scripts/test.py --setup-only`) and a browser, as the browser tests do. The shipped colon
is driven through as described in docs/colonoscopy_tutorial.md, the shipped plan is rehearsed as in
docs/rehearsal_tutorial.md, the head is registered as in docs/registration_tutorial.md, then written as a folder of
DICOM slices and used for a plan as in docs/planning_tutorial.md, with the names in these texts; a name that is not on
the page ends the script with an error. The libraries of 3D Slicer draw what is exported for it. Takes some minutes.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import httpx
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "browser")]

from workstation import TOKEN, Planner, Rest, Workstation, launch  # noqa: E402

from pictures import colonoscopy, registration, rehearsal, sample_plan, tutorial  # noqa: E402
from pictures.album import Album  # noqa: E402
from pictures.dicom_folder import write_dicom_folder  # noqa: E402
from pictures.named_page import NamedPage  # noqa: E402
from vfix_engine.anatomy.phantom import load_head_ct  # noqa: E402

SIZE = {"width": 1440, "height": 900}


def main() -> None:
    """Start a planner with an empty home, make all pictures, and stop it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "images", help="folder to write to")
    parser.add_argument("--only", choices=("head", "colon"), help="the pictures of one of them alone")
    args = parser.parse_args()
    album = Album(args.out)
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        folder = write_dicom_folder(load_head_ct(), work / "dicom")
        planner = Planner(work / "home")
        try:
            with sync_playwright() as playwright:
                browser = launch(playwright)
                context = browser.new_context(viewport=SIZE, accept_downloads=True)
                context.set_default_timeout(60_000)
                station = Workstation(context.new_page(), work)
                station.page.goto(f"{planner.base}/?token={TOKEN}")
                with Rest(planner.base, TOKEN).client as client:
                    page = NamedPage(station.ready(), album)
                    if args.only != "head":
                        walk_colon(page)
                    if args.only != "colon":
                        walk(page, client, folder, work)
                    if station.errors:
                        raise AssertionError(f"the page reported {station.errors}")
                browser.close()
        finally:
            planner.stop()


def walk(page: NamedPage, client: httpx.Client, folder: Path, work: Path) -> None:
    """Make every picture in turn. folder: contains the slices. work: receives exported files."""
    sample_plan.planned(page)
    rehearsal.begin(page)
    rehearsal.by_a_hand_on_the_robot(page)
    rehearsal.from_a_distance(page)
    rehearsal.in_a_free_hand(page)
    rehearsal.compare(page, work)
    page.press("3D + slices")
    registration.find_the_beads(page)
    registration.touch_them(page)
    registration.measure_one_wrongly(page)
    registration.use_it(page)
    registration.take_it_to_slicer(page, work)
    tutorial.import_the_folder(page, folder)
    tutorial.look_at_slices(page)
    tutorial.mark_the_orbit(page)
    tutorial.spare_the_orbit(page)
    tutorial.suggest_a_path(page)
    tutorial.read_the_verdict(page)
    tutorial.drag_a_point(page)
    tutorial.compare_tools(page)
    tutorial.name_a_version(page)
    tutorial.rehearse(page)
    tutorial.compare_and_export(page, work)


def walk_colon(page: NamedPage) -> None:
    """Make the pictures of the colon, and open the head again."""
    colonoscopy.open_the_colon(page)
    colonoscopy.read_the_route(page)
    colonoscopy.drive(page)
    colonoscopy.end_and_review(page)
    page.go_to("Patient")
    page.page.locator("#cases .row-main", has_text="Head phantom").click()
    page.wait("the head", lambda: (page.station.state("case") or {}).get("kind") == "head")
    page.press("3D + slices")


if __name__ == "__main__":
    main()
