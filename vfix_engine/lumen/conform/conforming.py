"""What a driven snake conforms to, and the shapes on the way from one that conforms to another."""

from __future__ import annotations

from dataclasses import replace

from ..anatomy.curve import Curve
from ..pathway.pathway import Pathway
from .conformance import ShapeSolution


def driven_curve(pathway: Pathway, curve: Curve | None) -> Curve:
    """What a snake conforms to at first: a pathway that moves takes its own centres along, and no other curve."""
    return curve if curve is not None and pathway.motion is None else pathway.curve(0.0)


def blended(one: ShapeSolution, two: ShapeSolution, share: float) -> ShapeSolution:
    """On the way from one conforming shape to another; the second, bit by bit, at 1."""
    if share >= 1.0:
        return two
    from scipy.spatial.transform import Rotation  # imported here: slow to load

    turn = Rotation.from_matrix(two.base[:3, :3] @ one.base[:3, :3].T).as_rotvec()
    base = one.base.copy()
    base[:3, :3] = Rotation.from_rotvec(share * turn).as_matrix() @ one.base[:3, :3]
    base[:3, 3] += share * (two.base[:3, 3] - one.base[:3, 3])
    q = one.q + share * (two.q - one.q)
    joint_s = one.joint_s + share * (two.joint_s - one.joint_s)
    offset_mm = one.offset_mm + share * (two.offset_mm - one.offset_mm)
    tip_s = min(one.tip_s + share * (two.tip_s - one.tip_s), two.curve.length)
    return replace(two, base=base, q=q, joint_s=joint_s, offset_mm=offset_mm, tip_s=tip_s, exact=False)
