"""The printable report on a plan as HTML: one page of A4, with its styles and pictures in it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from html import escape
from importlib.resources import files

from app import __version__
from app.planning.verdict import Level
from app.plans.model import NOTICE

_ICONS: dict[Level, str] = {"fits": "✓", "tight": "!", "unknown": "?", "blocked": "✕", "pierces": "✕"}


@dataclass(frozen=True)
class Figure:
    """A figure with its unit, its level, and where it is."""

    name: str
    value: str
    words: str
    level: Level | None = None


@dataclass(frozen=True)
class Picture:
    """A picture as SVG, and its caption."""

    caption: str
    svg: str


@dataclass(frozen=True)
class TableRow:
    """A row of a table. level: of a verdict, for its colour. strong: of the chosen path."""

    cells: tuple[str, ...]
    level: Level | None = None
    strong: bool = False


@dataclass(frozen=True)
class ReportPage:
    """What the page says.

    pictured: heading of the pictures. curves: name and colour of each line of the plot, which has an area if
    has_tissue. paths: none of a single one, which the verdict is on.
    """

    plan: str
    case: str
    instruments: str
    revision: int
    modified: str
    case_hash: str
    level: Level
    word: str
    words: str
    figures: tuple[Figure, ...]
    pictures: tuple[Picture, ...]
    pictured: str
    plot: str
    curves: tuple[tuple[str, str], ...]
    has_tissue: bool
    paths: tuple[TableRow, ...]
    targets: tuple[TableRow, ...]
    registration: str
    removed: str
    notes: str
    cautions: tuple[str, ...]

    def html(self) -> str:
        """The page."""
        title = f"{self.plan} – {self.case}"
        remarks = [text for text in (self.registration, self.removed, *self.cautions) if text]
        parts = (
            f"<header><div><h1>{escape(self.plan)}</h1><p>{escape(f'{self.case}, {self.instruments}')}</p></div>"
            f'<strong class="notice">{NOTICE}</strong></header>',
            self._verdict(),
            f'<dl class="figures">{"".join(_figure(figure) for figure in self.figures)}</dl>',
            self._pictures(),
            self._plot(),
            _table("Paths", ("Path", "Verdict", "Least clearance", "Length"), self.paths),
            _table("Targets", ("Target", "Place, mm", "Seen within", "Registration error, 95 %"), self.targets),
            "".join(f'<p class="remark">{escape(text)}</p>' for text in remarks),
            f'<section><h2>Notes</h2><p class="notes">{escape(self.notes)}</p></section>' if self.notes else "",
            f"<footer><span>{NOTICE}. Simulated with vfix {escape(__version__)}. R, L, A, P, S, I: right, left, front, "
            f"back, top and bottom of the patient.</span><span>Revision {self.revision}, {_when(self.modified)}; head "
            f"{escape(self.case_hash[:12])}</span></footer>",
        )
        return (
            f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
            f"<style>{_style()}</style></head>\n<body>{''.join(parts)}</body></html>\n"
        )

    def _verdict(self) -> str:
        words = self.words.removeprefix(self.word).lstrip(".:, ")
        return (
            f'<section class="verdict {self.level}"><span class="icon" aria-hidden="true">{_ICONS[self.level]}</span>'
            f"<strong>{escape(self.word)}</strong><p>{escape(words[:1].upper() + words[1:])}</p></section>"
        )

    def _pictures(self) -> str:
        if not self.pictures:
            return ""
        return (
            f'<section><h2>{escape(self.pictured)}</h2><div class="pictures">'
            f"{''.join(_picture(picture) for picture in self.pictures)}</div>"
            '<ul class="keys"><li><i class="tool-key"></i>tool in the cut</li><li><i class="path-key"></i>path in the '
            'cut</li><li><i class="tool-key faded"></i><i class="path-key dotted"></i>before or behind it</li>'
            '<li><i class="target-key"></i>target within 5 mm</li></ul></section>'
        )

    def _plot(self) -> str:
        if not self.plot:
            return ""
        keys = "".join(
            f'<li style="color:{escape(colour)}"><i class="line"></i><i class="dashed"></i>'
            f"<span>{escape(name)}, and its margin</span></li>"
            for name, colour in self.curves
        )
        area = '<li><i class="area"></i>depth in soft tissue</li>' if self.has_tissue else ""
        return (
            f'<section><h2>Clearance of the whole tool, mm</h2>{self.plot}<ul class="keys">{keys}{area}</ul></section>'
        )


def _when(time: str) -> str:
    """An ISO time as '26 Nov 2026, 07:15 UTC'."""
    at = datetime.fromisoformat(time).astimezone(UTC)
    return f"{at.day} {at:%b %Y, %H:%M} UTC"


def _figure(figure: Figure) -> str:
    return (
        f'<div class="{figure.level or ""}"><dt>{escape(figure.name)}</dt><dd><b>{escape(figure.value)}</b>'
        f"<span>{escape(figure.words)}</span></dd></div>"
    )


def _picture(picture: Picture) -> str:
    return f"<figure>{picture.svg}<figcaption>{escape(picture.caption)}</figcaption></figure>"


def _table(title: str, head: Iterable[str], rows: tuple[TableRow, ...]) -> str:
    if not rows:
        return ""
    columns = "".join(f'<th scope="col">{escape(name)}</th>' for name in head)
    body = "".join(
        f'<tr class="{row.level or ""}{" strong" if row.strong else ""}">'
        f"{''.join(f'<td>{escape(cell)}</td>' for cell in row.cells)}</tr>"
        for row in rows
    )
    table = f"<table><thead><tr>{columns}</tr></thead><tbody>{body}</tbody></table>"
    return f"<section><h2>{escape(title)}</h2>{table}</section>"


def _style() -> str:
    return files(__package__).joinpath("report.css").read_text(encoding="utf-8")
