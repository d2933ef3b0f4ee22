"""What a run is worth, from the run alone; docs/metrics.md has the definitions and their sources."""

from .score import MeanMax, RunScore, score_run
from .smoothness import log_dimensionless_jerk, moving, spectral_arc_length

__all__ = ["MeanMax", "RunScore", "log_dimensionless_jerk", "moving", "score_run", "spectral_arc_length"]
