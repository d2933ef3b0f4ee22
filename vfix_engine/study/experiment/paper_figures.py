"""The printed figures of Li & Taylor 2004 and Li, Ishii & Taylor 2007, and where the papers contradict themselves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class Printed(NamedTuple):
    """A printed figure: table or section, row, column, value, what follows ±, and a note."""

    table: str
    row: str
    column: str
    value: float | None
    sd: float | None = None
    note: str = ""


def printed(figure: Printed) -> float:
    """The value of a figure that has one."""
    assert figure.value is not None
    return figure.value


_WHAT_SD = "± is not said to be of subjects or of trials"
_NO_SD = "an experienced user, 5 trials; no standard deviation and no test in the text of V"

LI_2004: Mapping[str, Printed] = {
    "robot error": Printed("V", "Robot guidance", "error mm", 0.76, None, _NO_SD + "; by encoders, mapped to the CT"),
    "robot time": Printed("V", "Robot guidance", "time s", 17.24, None, _NO_SD),
    "freehand error": Printed("V", "Freehand", "error mm", 1.82, None, "a user; trials are not printed; tracker"),
    "freehand time": Printed("V", "Freehand", "time s", 26.61, None, "a user; trials are not printed"),
    "registration": Printed(
        "text",
        "Five fiducials",
        "residual mm",
        0.425,
        None,
        "from the localisation error that the residual of Li 2007 chose",
    ),
}

LI_2007: Mapping[str, Printed] = {
    "I hands-on error": Printed("I", "Hands-on", "error mm", 0.204, 0.01, _WHAT_SD),
    "I remote error": Printed("I", "Remote", "error mm", 0.219, 0.02, _WHAT_SD),
    "I error p": Printed("I", "Hands-on, Remote", "p of error", 0.3065),
    "I hands-on time": Printed("I", "Hands-on", "time s", 19.00, 2.31, _WHAT_SD),
    "I remote time": Printed("I", "Remote", "time s", 24.17, 4.14, _WHAT_SD),
    "I time p": Printed("I", "Hands-on, Remote", "p of time", 0.0, None, "printed as 0"),
    "II hands-on error": Printed("II", "Hands-on", "error mm", 0.993, 0.136),
    "II remote error": Printed("II", "Remote", "error mm", 0.720, 0.112),
    "II freehand error": Printed("II", "Free hand", "error mm", 2.468, 0.981),
    "II hands-on remote p": Printed(
        "V.F.2", "Hands-on, Remote", "p of true error", 1e-6, None, "printed as p < 0.000001"
    ),
    "II hands-on time": Printed("II", "Hands-on", "time s", 19.00, 2.31),
    "II remote time": Printed("II", "Remote", "time s", 24.17, 4.14),
    "II freehand time": Printed("II", "Free hand", "time s", 27.56, 8.82),
    "inspection encoders mean": Printed("V.D", "Inspection, encoders", "error mm", 0.02, 0.02),
    "inspection encoders max": Printed("V.D", "Inspection, encoders", "largest error mm", 0.08),
    "inspection tracker mean": Printed("V.D", "Inspection, tracker", "error mm", 0.34, 0.15),
    "inspection tracker max": Printed("V.D", "Inspection, tracker", "largest error mm", 0.81),
    "registration": Printed("V.B", "Five fiducials", "residual mm", 0.473, 0.07),
    "rows of A·J fewest": Printed("V.E", "Rows of A·J in (21)", "fewest", 20),
    "rows of A·J most": Printed("V.E", "Rows of A·J in (21)", "most", 39),
    "rows of W·J fewest": Printed("V.E", "Rows of W·J in (20)", "fewest", 13),
    "rows of W·J most": Printed("V.E", "Rows of W·J in (20)", "most", 37),
    "NNLS iterations": Printed("V.E", "Iterations of NNLS", "most", 20, None, "printed: less than 21"),
    "said faster": Printed("V.F.2", "All subjects faster hands-on", "share of subjects", 1.0),
    "said smoother": Printed(
        "V.F.2", "Joint velocities smoother hands-on", "share of subjects", None, None, "figures 13, 14"
    ),
    "said second half": Printed(
        "V.F.2", "Freehand error larger in the second half", "share of subjects", None, None, "figure 15"
    ),
    "said contacts": Printed("V.F.2", "Contacts of the shaft, robot modes", "contacts", 0.0),
}

CONTRADICTIONS = (
    "Li 2007, Table I: p = 0.3065 cannot follow from 0.204 ± 0.01 and 0.219 ± 0.02 if ± is the standard deviation of "
    "ten subjects' means: a paired t test gives at most 0.148, at most 0.297 with every rounding.",
    "Li 2007: ± of the times in Table I is 'st. dev.' of the times in Table II, so ± is a standard deviation there; of "
    "subjects or of trials is not printed.",
    "Li 2007: the text finds a significant improvement of 'execution time, compared to free hand'; 24.17 ± 4.14 s "
    "remote against 27.56 ± 8.82 s reaches p < 0.05 in ten pairs only where both correlate by 0.992 or more.",
    "Both papers: with one row of W for a pair of the boundary, maxima of 39 and 37 rows are 24 pairs, minima of 20 "
    "and 13 are 5 and 0: the minima of A·J (H·J in 2004) and W·J are not of the same step.",
    "Li 2004 names backlash as a part of the robot's error of 0.76 mm, which was measured by joint "
    "encoders; if they sit at the motors, which is not printed, they do not see it.",
    "Li 2004: 0.76 mm by encoders mapped to the CT against Li 2007's 0.204 mm by encoders in the robot's frame; which "
    "part of the difference is registration and which is control is not printed.",
)
