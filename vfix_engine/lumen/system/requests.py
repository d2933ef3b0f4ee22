"""Requests that only a snake understands."""

from __future__ import annotations

from dataclasses import dataclass

from ...runtime.requests import Request


@dataclass(frozen=True)
class FollowTissue(Request):
    """Whether the robot's shape follows the moving tissue; without it links leave the pathway as that moves.

    The pathway is seen and the certificate holds either way: nothing goes deeper than the tissue has brought it.
    """

    on: bool
