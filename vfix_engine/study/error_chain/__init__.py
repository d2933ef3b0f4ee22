"""What really happens: from where a run has the tool to where it truly was; docs/error_chain.md derives it."""

from .chain import PAPERS, ErrorChain
from .stages import Compliance, EncoderError, HeadMotion, RegistrationError, ServoLag
from .tally import TruthTally
from .true_tool import Sample, TrueTool, Truth, sample_of

__all__ = [
    "PAPERS", "Compliance", "EncoderError", "ErrorChain", "HeadMotion", "RegistrationError", "Sample", "ServoLag",
    "TrueTool", "Truth", "TruthTally", "sample_of",
]  # fmt: skip
