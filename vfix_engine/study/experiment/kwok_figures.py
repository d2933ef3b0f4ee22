"""The printed figures of Kwok 2013, Tables III and IV, and where its text and tables meet or contradict each other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from ..polyps.table import PRINTED
from .paper_figures import Printed

SUBJECTS = 12  # as printed, three of them clinicians
ROWS: Mapping[str, tuple[str, str, float, float]] = {
    "completion_time_s": ("Complet. Time", "s", 57.0, 0.0001),
    "travelled_mm": ("Aver. Trav. Dist.", "mm", 79.0, 0.0),
    "polyps_missed": ("No. of Polyps Missed", "", 100.0, 0.104),
    "distance_error_mm": ("Aver. Dist. Err.", "mm", 36.0, 0.0004),
    "angle_error_deg": ("Aver. Ang. Err.", "°", 38.0, 0.0001),
    "times_missed": ("No. of Times Missed", "", 36.0, 0.0314),
    "deviations": ("No. of Times", "", 46.0, 0.0025),
    "deviation_max_mm": ("Max. Depth", "mm", 68.0, 0.0),
    "deviation_mean_mm": ("Aver. Depth", "mm", 70.0, 0.0),
    "deviation_time_mean_s": ("Aver. Time", "s", 89.0, 0.0004),
    "deviation_time_max_s": ("Max. Time", "s", 94.0, 0.0004),
    "deviation_length_mm": ("Total Length", "mm", 91.0, 0.0),
}
"""Of Table III, by the names of ``TableIII``: row, unit, improvement in %, and p, which is printed to four digits."""

WITHOUT, WITH, IMPROVED, P = "w/o DAC", "with DAC", "improvement %", "p"

TABLE_IV: Mapping[str, tuple[str, tuple[tuple[float | None, float | None], ...]]] = {
    "time_s": ("Compl. Time (s)", ((21.4, 9.17), (18.1, 3.69), (21.0, 3.21), (15.6, 2.33), (18.7, 3.30), (23.3, 5.46))),
    "angle_error_deg": (
        "Ang. Err. (°)", ((1.36, 0.35), (1.34, 0.27), (1.68, 0.27), (0.99, 0.24), (1.50, 0.23), (1.67, 0.19)),
    ),
    "line_error_mm": (
        "Dist. Err. (mm)", ((0.37, 0.16), (0.33, 0.09), (0.30, 0.07), (0.41, 0.14), (0.28, 0.08), (0.38, 0.06)),
    ),
    "distance_mm": (
        "Trav. Dist. (mm)", ((None, None), (134.0, 45.7), (108.0, 91.0), (63.6, 24.9), (103.0, 103.0), (143.0, 138.0)),
    ),
}  # fmt: skip
"""Of each row the mean and the standard deviation of the six labels; N/A is None."""


class PrintedRow(NamedTuple):
    """A row of Table III as it is printed."""

    without: Printed
    with_dac: Printed
    improved: Printed
    p: Printed


def _row(name: str) -> PrintedRow:
    row, unit, improved, p = ROWS[name]
    called = f"{row} ({unit})" if unit else row
    (before, before_sd), (after, after_sd) = PRINTED[name]
    note = "printed as .0000" if p == 0.0 else ""
    return PrintedRow(
        Printed("III", called, WITHOUT, before, before_sd), Printed("III", called, WITH, after, after_sd),
        Printed("III", called, IMPROVED, improved), Printed("III", called, P, p, None, note),
    )  # fmt: skip


KWOK_III: Mapping[str, PrintedRow] = {name: _row(name) for name in ROWS}
KWOK_IV: Mapping[str, tuple[Printed, ...]] = {
    name: tuple(Printed("IV", row, f"label {label + 1}", mean, sd) for label, (mean, sd) in enumerate(labels))
    for name, (row, labels) in TABLE_IV.items()
}

AGREES_III = (
    "Table III: every improvement is that of the printed means, to half a per cent.",
    "Table III: 0.33 ± 0.65 polyps missed by twelve people, of whom 'three … were not able to target one or more', are "
    "one, one and two polyps of three people: the standard deviation is 0.651, so ± is that of the subjects. A "
    "paired t test gives p = 0.104, as printed, and so does Welch's; one with a pooled variance gives 0.090.",
    "Table III: 'always higher than 30 %' is 36 % at the least; of the p-values eleven of twelve are below 0.05.",
)
AGREES_IV = ("Table IV: '<1.7° and <0.5 mm' are 1.68° and 0.41 mm at the most.",)
CONTRADICTIONS_III = (
    "Table III prints the improvement of 'No. of Polyps Missed' as 100 %, of a difference that is not significant "
    "(p = 0.104).",
    "Table III: p of 'Complet. Time', printed as .0001 (of which test is not in the text), follows from the printed "
    "means and deviations by a paired t test only where who is slow without the control is fast with it, with a "
    "correlation of -0.67 or less; by a test of unpaired people it is less than 0.00005.",
)
CONTRADICTIONS_IV = (
    "Section IV.C.2 says that the path-following of study II 'cannot be accomplished by manual joint actuation', and "
    "has no control experiment that shows it.",
    "Table IV, 'averaged across the 12 subjects', does not say of what its SD is. The text takes that of the ways as "
    "'different searching behaviors performed by the subjects', but low ones of times and errors 'for each subject' as "
    "repeatability, which a deviation over subjects cannot show; and 9.17 s of 21.4 s is not low.",
    "Table IV: SD of the way to labels 3, 5 and 6 is about as large as its mean, so the mean is of no typical person.",
)
