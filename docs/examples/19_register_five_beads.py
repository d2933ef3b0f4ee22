"""Register a head by five beads: find them in its CT, touch them, and compute the expected error at a target."""

import numpy as np

from vfix_engine.anatomy.phantom import load_head_ct, load_landmarks
from vfix_engine.registration import SimulatedTracker, calibrate_pivot, find_beads, find_outlier, match_points

# The image: five beads on the skin of the shipped head, and a target in its nose.
search = find_beads(load_head_ct())
target = load_landmarks().targets[0].position
assert len(search.beads) == 5, search.cautions

# The patient: the same head before a tracker, whose pointer is swung about its tip once and then touches the beads.
truth = np.array([[0.0, -1.0, 0.0, 90.0], [0.6, 0.0, -0.8, -40.0], [0.8, 0.0, 0.6, 950.0], [0.0, 0.0, 0.0, 1.0]])
tracker = SimulatedTracker(seed=4)
pointer = calibrate_pivot(tracker.pivot([0.0, 100.0, 900.0]))
poses = [tracker.touch(truth[:3, :3] @ bead + truth[:3, 3]) for bead in search.positions_mm[[3, 0, 4, 1, 2]]]
touched = np.array([pose[:3, :3] @ pointer.tip_mm + pose[:3, 3] for pose in poses])

# The registration: in which order the beads were touched is found as well.
match = match_points(fixed=touched, moving=search.positions_mm)
registration = match.registration
assert not match.ambiguous
assert find_outlier(registration.fixed, registration.moving) is None
print(f"touched in the order {match.moving.tolist()}, FRE {registration.fre_mm:.2f} mm")

# FRE says how well the beads fit; what counts is the error at the target.
expected, ball = (ask(target, registration.fle_mm)[0] for ask in (registration.tre_mm, registration.tre_95_mm))
off = np.linalg.norm(registration.to_fixed(target) - (truth[:3, :3] @ target + truth[:3, 3]))
print(f"at the target {expected:.2f} mm expected, below {ball:.2f} mm in 95 of 100 cases; it is {off:.2f} mm off")
assert off < 2.0 * ball
