"""`vfix case export` and `vfix case import-archive`: a case with everything that belongs to it as one zip."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from app.cases.model import Case
from app.exchange.patient_images import check_images
from app.services import Services
from app.store.files import open_atomically


def add_parsers(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> list[argparse.ArgumentParser]:
    export = actions.add_parser("export", help="write a case with its plans, surfaces and volumes to a zip")
    export.add_argument("case", metavar="CASE", help="id or name")
    export.add_argument("file", metavar="FILE.zip", type=Path, help="replaced where it is there")
    export.add_argument("--with-images", action="store_true", help="confirm that the patient's images are written")
    export.add_argument("--runs", action="store_true", help="the manifests of recorded drives as well")
    read = actions.add_parser("import-archive", help="make a case of such a zip")
    read.add_argument("file", metavar="FILE.zip", type=Path, help="made by vfix case export")
    return [export, read]


def write(args: argparse.Namespace, services: Services, case: Case) -> int:
    """Write the archive whole or not at all. Raises InputError where it holds images and that was not confirmed."""
    check_images(case, args.with_images, "--with-images")
    with open_atomically(args.file) as target:
        left_out = services.archive_writer.write(case.id, target, with_runs=args.runs)
    for one in left_out:
        print(f"vfix: left out, since it cannot be read: {one['kind']} '{one['name']}': {one['why']}", file=sys.stderr)
    size = args.file.stat().st_size
    answer = {"case": case.id, "name": case.name, "file": str(args.file), "size_bytes": size}
    words = f"{args.file} written, {size / 1e6:.1f} MB. Not for clinical use."
    print(json.dumps(answer) if args.json else words)
    return 0


def read(args: argparse.Namespace, services: Services) -> Case:
    """Import an archive. Raises InputError with what is wrong with it."""
    return services.archive_reader.read(args.file)
