"""Verbs of kinds of documents that have no command of their own: list them, and whatever their operations are."""

from __future__ import annotations

import argparse
from typing import Any

import msgspec

from app.documents.documents import Documents
from app.exchange.resolve import find
from app.operations import verbs
from app.operations.spec import DocumentSpec
from app.services import Services, build_services
from app.settings import Settings


class DocumentCommand:
    """The verb of one kind."""

    def __init__(self, line: str, spec: DocumentSpec) -> None:
        self._line, self._spec = line, spec

    def add_parser(self, subparsers: verbs.Actions) -> argparse.ArgumentParser:
        """As of every verb's module."""
        words = f"{self._spec.path} of a case"
        parser = subparsers.add_parser(self._line, help=words, description=f"{words}. Not for clinical use.")
        actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
        listing = actions.add_parser("list", help=words)
        listing.add_argument("case", metavar="CASE", help="id or name")
        found = [listing, *verbs.add_actions(self._line, actions).values()]
        for group in verbs.groups(self._line):
            inner = actions.add_parser(group, help=f"{group}s of one of the {self._spec.path}")
            parts = inner.add_subparsers(dest="part", metavar="ACTION", required=True)
            found += verbs.add_actions(f"{self._line} {group}", parts).values()
        for each in found:
            each.add_argument("--json", action="store_true", help="one JSON object on stdout")
        return parser

    def run(self, args: argparse.Namespace) -> int:
        """Execute the action and print what is there afterwards. Raises VfixError."""
        services = build_services(Settings.from_environment())
        case_id = find(services.cases.list(), args.case, "case").id if "case" in args else ""
        if "part" in args:
            line, said = f"{self._line} {args.action}", argparse.Namespace(**{**vars(args), "action": args.part})
        else:
            line, said = self._line, args
        called = verbs.called_action(line, said)
        if called is None:
            found = self._documents(services).list(case_id)
        else:
            found = (called.perform(services, case_id, lambda text: self._named(services, text)),)
        service = self._spec.context(services).service
        answers = [self._spec.answer_of(service, document) for document in found]
        if args.json:
            print(msgspec.json.encode({self._spec.path: answers}).decode())
        else:
            print("\n".join(f"{document.id:24}  {document.name}" for document in found))
        return 0

    def _documents(self, services: Services) -> Documents[Any]:
        return self._spec.context(services).documents

    def _named(self, services: Services, text: str) -> str:
        titles = self._documents(services).titles(include_deleted=True)
        return find(titles, text, self._spec.kind.noun).id
