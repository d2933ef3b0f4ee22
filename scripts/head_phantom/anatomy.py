"""The head, assembled from its parts in anatomical order."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from head_phantom.blending import Field, intersection, receded, union, without
from head_phantom.parts import cranium, face, jaws, neck, nose, sinuses, soft
from head_phantom.shapes import Box, Part, Points
from head_phantom.space import REACH, Space

MUCOSA = np.float32(1.35)  # [mm] lining of the nose
SINUS_MUCOSA = np.float32(0.6)  # [mm]
JOINT_SPACE = np.float32(1.8)  # [mm] between the condyle and its fossa
FADING = 4.0  # [mm] over which a suture ends
SKIN_OVER_BONE = np.float32(5.0)  # [mm]


@dataclass(frozen=True)
class Cavities:
    """Cavities of the bone before mucosa is added: signed distances [mm]."""

    orbits: Field
    nose: Field
    sinuses: Field
    canals: Field
    by_name: dict[str, Field]
    brain: Field


@dataclass(frozen=True)
class Head:
    """Signed distances [mm] of the tissues, negative inside."""

    skull: Field
    mandible: Field
    vertebrae: Field
    teeth: Field
    thin_bone: Field  # septum, turbinates
    air: Field  # airway and sinuses, without the outside
    lining: Field  # soft tissue of nose and nostrils
    nostrils: Field
    skin: Field
    brain: Field
    orbits: Field
    eyes: Field
    eye_muscles: Field
    muscles: Field
    antra: Field  # maxillary sinuses, to the bone
    sinuses: Field  # all sinuses, to the bone

    @property
    def bone(self) -> Field:
        """All hard tissue."""
        hard = np.minimum(np.minimum(self.skull, self.mandible), np.minimum(self.vertebrae, self.teeth))
        return np.minimum(hard, self.thin_bone)


def head(space: Space, septum_bend_mm: float = nose.SEPTUM_BEND_MM) -> Head:
    """Return all tissues in a block of space; septum_bend_mm: see ``nose.Septum``."""
    vault = space.build(cranium.VAULT)
    outline = _outline(space, vault)
    teeth = space.build(jaws.TEETH, reach=3.0)
    cavities = _cavities(space, vault, outline, teeth)
    mandible = space.build(jaws.MANDIBLE) + np.float32(0.15) * space.fine
    skull = _skull(space, outline, cavities)
    skull, mandible = _sockets(space, skull, mandible, teeth, cavities)
    skull = without(skull, mandible - JOINT_SPACE, 1.0)
    vertebrae = space.build(neck.vertebrae(), reach=6.0) + np.float32(0.2) * space.fine
    septum, turbinates, thin_bone = _septum_and_turbinates(space, cavities, septum_bend_mm)
    nostrils = space.build(nose.NOSTRILS, reach=6.0)
    ostia = space.build(sinuses.OSTIA, reach=3.0)
    eyes = space.build(soft.EYE, reach=6.0)
    return Head(
        skull=np.maximum(skull, np.float32(0.5) - ostia),
        mandible=mandible,
        vertebrae=vertebrae,
        teeth=teeth,
        thin_bone=np.maximum(thin_bone, np.float32(0.3) - ostia),
        air=_air(space, cavities, septum, turbinates, nostrils, ostia, teeth),
        lining=np.minimum(cavities.nose, nostrils),
        nostrils=nostrils,
        skin=_skin(space, union(outline, mandible, 4.0), cavities, eyes),
        brain=cavities.brain,
        orbits=cavities.orbits,
        eyes=eyes,
        eye_muscles=space.build(soft.EYE_MUSCLES, reach=4.0),
        muscles=space.build(soft.CHEWING_MUSCLES),
        antra=cavities.by_name["maxillary"],
        sinuses=cavities.sinuses,
    )


def _outline(space: Space, vault: Field) -> Field:
    """Return the outside of braincase and face, still solid."""
    solid = space.build((*cranium.FRONTAL_BONE, *face.BROW, *face.MAXILLA, *cranium.FOSSAE), onto=vault)
    solid = space.build((*face.CHEEK, *jaws.UPPER_JAW, *cranium.TEMPORAL_BONE, *cranium.OCCIPITAL_BONE), onto=solid)
    return space.build((*jaws.PALATE_VAULT, *soft.CHOANAE), onto=solid)


def _cavities(space: Space, vault: Field, outline: Field, teeth: Field) -> Cavities:
    orbits = space.build(face.ORBITS)
    nasal = space.build(nose.NASAL_CAVITY, reach=8.0)
    canals = space.build([Part("infraorbital canal", face.INFRAORBITAL_CANAL, paired=True)], reach=4.0)
    # The sinuses also keep a distance from the roots of the teeth and from the nerve.
    earlier = np.minimum(np.minimum(orbits, nasal), np.minimum(teeth, canals))
    every, by_name = space.empty(), {}
    for sinus in sinuses.SINUSES:
        reach = 1.5 if sinus.name == "ethmoid" else 5.0
        hollow = space.build([Part(sinus.name, sinus.left, paired=True)], reach=reach)
        hollow = receded(hollow, earlier, sinus.wall, sinus.rounding)
        if sinus.cover is not None:
            hollow = intersection(hollow, outline + np.float32(sinus.cover), sinus.rounding)
        by_name[sinus.name] = hollow
        earlier, every = np.minimum(earlier, hollow), np.minimum(every, hollow)
    brain = vault + np.float32(cranium.VAULT_THICKNESS) + np.float32(cranium.VAULT_THICKNESS_SPREAD) * space.coarse
    brain = space.build(cranium.BRAIN, onto=brain)
    brain = receded(brain, np.minimum(orbits - np.float32(0.4), nasal - np.float32(0.6)), 1.8, 4.0)
    brain = receded(brain, every, 1.8, 3.0)
    return Cavities(orbits, nasal, every, canals, by_name, brain)


def _skull(space: Space, outline: Field, cavities: Cavities) -> Field:
    """Return the skull above the lower jaw with its cavities."""
    solid = _nasal_bones(space, outline, cavities.nose)
    solid = space.build(jaws.ANTERIOR_NASAL_SPINE, onto=solid)
    braincase = union(solid, intersection(cavities.brain - np.float32(cranium.BASE_THICKNESS), 24 - space.y, 4.0), 4.0)
    skull = without(braincase, cavities.brain, 2.0)
    skull = union(skull, intersection(space.build(cranium.BASE), braincase - np.float32(2.0), 3.0), 3.0)
    skull = space.build((*cranium.PTERYGOID, *cranium.FORAMINA, *face.FACIAL_FORAMINA), onto=skull)
    skull = union(skull, _walls(space, cavities), 0.8)
    skull = skull + _sutures(space, cavities.brain) + np.float32(0.2) * space.fine
    skull = without(skull, cavities.orbits, 1.0)
    skull = space.build(cranium.ORBITAL_FISSURES, onto=skull)
    skull = without(skull, cavities.canals, 0.8)
    return np.maximum(skull, -np.minimum(cavities.nose, cavities.sinuses))


def _nasal_bones(space: Space, outline: Field, nasal: Field) -> Field:
    """Return a thin roof over the front of the nasal cavity, cut at the piriform rim."""
    rim = nose.PIRIFORM_RIM
    roof = intersection(nasal - np.float32(1.8), 4 - space.z, 2.0)
    roof = intersection(roof, space.y - np.float32(30), 2.0)
    with_roof = union(outline, roof, 4.5)
    return space.build([Part("in front of the piriform rim", rim, 1.5, taken=True)], onto=with_roof)


def _walls(space: Space, cavities: Cavities) -> Field:
    """Return thin bone around every cavity, so that no wall is missing, except in front of the face."""
    orbital_margin = np.float32(16) + np.float32(0.38) * np.maximum(np.abs(space.x) - 14, 0) - space.y
    around_orbits = intersection(cavities.orbits - np.float32(1.4), orbital_margin, 2.0)
    around_nose = intersection(cavities.nose - np.float32(1.3), -11 - space.z, 1.0)
    around_nose = intersection(around_nose, space.y - np.float32(56), 1.0)
    walls = np.minimum(np.minimum(cavities.sinuses - np.float32(0.75), around_orbits), around_nose)
    inside_face = intersection(np.abs(space.x) - np.float32(44), 13 - space.y, 2.0)
    inside_face = intersection(inside_face, -nose.PIRIFORM_RIM.in_front(space.points), 1.0)
    return intersection(walls, inside_face, 1.5)


def _sutures(space: Space, brain: Field) -> Field:
    """Return what to add to the distance of the skull in mm: > 0 along sutures, < 0 along ridges."""
    added = np.zeros_like(brain)
    for line in cranium.LINES:
        for mirrored in (False, True) if line.paired else (False,):
            block = space.block(line.box, 0.0, mirrored)
            if block is None:
                continue
            x, y, z = (-space.x if mirrored else space.x)[block], space.y[block], space.z[block]
            if line.plane is not None:
                (a, b, c), offset = line.plane
                off = (a * x + b * y + c * z - offset) / np.float32(np.sqrt(a * a + b * b + c * c))
            else:
                assert line.arc is not None  # a line is one or the other
                (y0, z0), radius = line.arc
                off = np.hypot(y - np.float32(y0), z - np.float32(z0)) - np.float32(radius)
            off = off + np.float32(line.serration) * (space.fine[block] + space.coarse[block])
            groove = np.float32(line.depth) * np.exp(-((off / np.float32(line.width)) ** 2))
            outer = np.clip(brain[block] - 2, 0, 1)  # not on the inside of the braincase
            groove = groove * outer * _fading(line.box, Points(x, y, z))
            added[block] = np.where(np.abs(groove) > np.abs(added[block]), groove, added[block])
    return added.astype(np.float32)


def _fading(box: Box, at: Points) -> Field:
    """Return a weight that is 1 inside a box and falls to 0 at its sides over `FADING` mm."""
    depth: Field = np.full(1, FADING, dtype=np.float32)
    for coordinate, low, high in zip(at, *box, strict=True):
        depth = np.minimum(depth, np.minimum(coordinate - np.float32(low), np.float32(high) - coordinate))
    fading: Field = np.clip(depth / np.float32(FADING), 0, 1)
    return fading


def _sockets(space: Space, skull: Field, mandible: Field, teeth: Field, cavities: Cavities) -> tuple[Field, Field]:
    """Return skull and mandible with bone over the roots of the teeth."""
    over_roots = teeth - np.float32(0.8)
    hollow = np.minimum(cavities.nose, cavities.sinuses)
    upper = np.maximum(np.maximum(over_roots, -14.5 - space.z), -hollow)
    lower = np.maximum(over_roots, space.z + np.float32(35.5))
    return union(skull, upper, 2.0), union(mandible, lower, 2.0)


def _septum_and_turbinates(space: Space, cavities: Cavities, bend_mm: float) -> tuple[Field, Field, Field]:
    """Return septum and turbinates with their mucosa, and the thin bone in both."""
    bony, lined = (replace(one, bend_mm=bend_mm) for one in (nose.BONY_SEPTUM, nose.SEPTUM_WITH_MUCOSA))
    septum = space.build([Part("septum", lined)], reach=8.0)
    mucosa = [Part(t.name, t.with_mucosa, 1.0, paired=True) for t in nose.TURBINATES]
    bone = [Part(t.name, t.bone, paired=True) for t in nose.TURBINATES]
    in_nose = cavities.nose - np.float32(0.8)  # rooted in the wall
    thin = np.minimum(space.build([Part("septum", bony)], reach=4.0), space.build(bone, reach=4.0))
    thin = np.maximum(thin, in_nose) + np.float32(0.06) * space.fine
    return septum, space.build(mucosa, reach=4.0), thin


def _air(
    space: Space,
    cavities: Cavities,
    septum: Field,
    turbinates: Field,
    nostrils: Field,
    ostia: Field,
    teeth: Field,
) -> Field:
    """Return the airway from the nostrils to the neck, and the sinuses, connected by their ostia."""
    nasal = without(cavities.nose + MUCOSA + np.float32(0.15) * space.coarse, septum, 0.8)
    nasal = without(nasal, turbinates, 0.8)
    nasal = intersection(nasal, -4 - space.y, 1.0)
    columella = np.abs(space.x + np.float32(0.5)) - np.float32(1.7)
    air = union(nasal, np.maximum(nostrils, -columella), 1.5)
    air = np.minimum(air, cavities.sinuses + SINUS_MUCOSA + np.float32(0.12) * space.fine)
    air = np.minimum(air, ostia)
    air = union(air, without(space.build(soft.PHARYNX, reach=6.0), septum, 0.8), 2.5)
    mouth = space.build(soft.MOUTH, reach=4.0)
    everywhere: Field = np.minimum(air, np.maximum(mouth, np.float32(1.2) - teeth))
    return everywhere


def _skin(space: Space, bone: Field, cavities: Cavities, eyes: Field) -> Field:
    outline = space.build((*soft.HEAD_OUTLINE, *soft.EXTERNAL_NOSE), reach=22.0)
    over_nose = np.maximum(cavities.nose - np.float32(4.2), 2 - space.z)
    outline = union(outline, np.maximum(over_nose, space.y - np.float32(40)), 6.0)
    outline = union(outline, bone - SKIN_OVER_BONE, 8.0)
    outline = union(outline, eyes - np.float32(2.2), 6.0)
    return space.build(soft.EYELIDS, onto=outline, reach=REACH) + np.float32(0.15) * space.coarse
