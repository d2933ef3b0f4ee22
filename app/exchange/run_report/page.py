"""The printable report on runs as HTML: pages of A4, with their styles and figures in them."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from importlib.resources import files

from app import __version__
from app.plans.model import NOTICE


@dataclass(frozen=True)
class ReportedRun:
    """A run of the report. label: a letter, where there are several; colour, dashes: of its curves.

    words: how it was driven; certified: False for a free hand. of: its id, and when it was recorded.
    """

    label: str
    colour: str
    dashes: str
    words: str
    certified: bool
    of: str


@dataclass(frozen=True)
class ScoreRow:
    """A metric, and its value for each run. caution: numbers of the runs whose value is one to look at."""

    name: str
    values: tuple[str, ...]
    caution: tuple[int, ...] = ()


@dataclass(frozen=True)
class HoldRow:
    """A hold: label of its run, when, for how long, why and where; caution: the tool was in a structure."""

    cells: tuple[str, ...]
    caution: bool = False


@dataclass(frozen=True)
class Table:
    """A further table: its heading, the names of its columns, and its rows."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class RunReportPage:
    """What the report says. figures: heading and SVG. more_holds: number of holds that are not listed.

    comments: label of the run, time, and text of each. uncertified: how a run without the certificate was driven.
    holds_title: what is listed beside the scores. tables: after the figures.
    """

    title: str
    subtitle: str
    runs: tuple[ReportedRun, ...]
    scores: tuple[ScoreRow, ...]
    figures: tuple[tuple[str, str], ...]
    holds: tuple[HoldRow, ...]
    more_holds: int
    comments: tuple[tuple[str, ...], ...] = ()
    uncertified: str = (
        "by a free hand: bone does not stop the tool. Contacts are counted, not prevented."  # of a rigid tool
    )
    holds_title: str = "Holds and contacts"
    tables: tuple[Table, ...] = ()

    def html(self) -> str:
        """The page."""
        parts = (
            f"<header><div><h1>{escape(self.title)}</h1><p>{escape(self.subtitle)}</p></div>"
            f'<strong class="notice">{NOTICE}</strong></header>',
            *(self._caution(run) for run in self.runs if not run.certified),
            self._scores(),
            *(f"<section><h2>{escape(name)}</h2>{svg}</section>" for name, svg in self.figures if svg),
            *(self._table(table) for table in self.tables),
            self._holds(),
            self._comments(),
            f"<footer><span>{NOTICE}. Scored with vfix {escape(__version__)}. R, L, A, P, S, I: right, left, front, "
            f"back, top and bottom of the patient.</span>"
            f"<span>{escape('; '.join(run.of for run in self.runs))}</span></footer>",
        )
        return (
            f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(self.title)}</title>'
            f"<style>{_style()}</style></head>\n<body>{''.join(parts)}</body></html>\n"
        )

    @property
    def _several(self) -> bool:
        return len(self.runs) > 1

    def _caution(self, run: ReportedRun) -> str:
        which = f"Run {run.label} was driven" if self._several else "Driven"
        return (
            f'<section class="verdict blocked"><span class="icon" aria-hidden="true">!</span>'
            f"<strong>Without the certificate</strong><p>{escape(f'{which} {self.uncertified}')}</p></section>"
        )

    def _scores(self) -> str:
        """A figure for each metric of one run, a table with a column for each of several."""
        if not self._several:
            return f'<dl class="figures">{"".join(_figure(row) for row in self.scores)}</dl>'
        heads = "".join(
            f'<th scope="col" class="{"" if run.certified else "uncertified"}">{_label(run)}{escape(run.words)}</th>'
            for run in self.runs
        )
        rows = "".join(_row(row) for row in self.scores)
        table = f'<table class="scores"><thead><tr><th></th>{heads}</tr></thead><tbody>{rows}</tbody></table>'
        return f"<section><h2>Score</h2>{table}</section>"

    def _holds(self) -> str:
        if not self.holds:
            return f"<section><h2>{self.holds_title}</h2><p>None.</p></section>"
        names = (*(("Run",) if self._several else ()), "At", "For", "Reason", "Place, mm")
        columns = "".join(f'<th scope="col">{name}</th>' for name in names)
        body = "".join(
            f'<tr class="{"blocked" if row.caution else ""}">'
            f"{''.join(f'<td>{escape(cell)}</td>' for cell in row.cells[not self._several :])}</tr>"
            for row in self.holds
        )
        more = f'<p class="remark">… and {self.more_holds} shorter ones.</p>' if self.more_holds else ""
        table = f'<table class="holds"><thead><tr>{columns}</tr></thead><tbody>{body}</tbody></table>'
        apart = '<p class="remark">Interruptions of up to 0.3 s are not told apart.</p>'
        return f"<section><h2>{self.holds_title}, the longest first</h2>{table}{more}{apart}</section>"

    @staticmethod
    def _table(table: Table) -> str:
        columns = "".join(f'<th scope="col">{escape(name)}</th>' for name in table.columns)
        body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in table.rows)
        head = f"<thead><tr>{columns}</tr></thead>"
        rows = f'<table class="marks">{head}<tbody>{body}</tbody></table>'
        return f"<section><h2>{escape(table.title)}</h2>{rows}</section>"

    def _comments(self) -> str:
        if not self.comments:
            return ""
        names = (*(("Run",) if self._several else ()), "At", "Comment")
        columns = "".join(f'<th scope="col">{name}</th>' for name in names)
        body = "".join(
            f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in cells[not self._several :])}</tr>"
            for cells in self.comments
        )
        table = f'<table class="comments"><thead><tr>{columns}</tr></thead><tbody>{body}</tbody></table>'
        return f"<section><h2>Comments</h2>{table}</section>"


def _label(run: ReportedRun) -> str:
    """The letter of a run with a piece of its line."""
    dashes = f' stroke-dasharray="{run.dashes}"' if run.dashes else ""
    line = f'<svg viewBox="0 0 7 2" aria-hidden="true"><path d="M0 1H7" stroke="{run.colour}"{dashes}/></svg>'
    return f'<b class="run" style="color:{run.colour}">{escape(run.label)}</b>{line}'


def _figure(row: ScoreRow) -> str:
    """The metric of a single run; its unit is in its name."""
    caution = ' class="caution"' if row.caution else ""
    return f"<div><dt>{escape(row.name)}</dt><dd><b{caution}>{escape(row.values[0])}</b></dd></div>"


def _row(row: ScoreRow) -> str:
    cells = "".join(
        f'<td class="{"caution" if index in row.caution else ""}">{escape(value)}</td>'
        for index, value in enumerate(row.values)
    )
    return f'<tr><th scope="row">{escape(row.name)}</th>{cells}</tr>'


def _style() -> str:
    """The style of the report on a plan, and what tables and figures of runs add."""
    common = files("app.exchange.report").joinpath("report.css").read_text(encoding="utf-8")
    return common + files(__package__).joinpath("run_report.css").read_text(encoding="utf-8")
