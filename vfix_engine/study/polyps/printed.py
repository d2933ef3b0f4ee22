"""Numbers of study I that its parts and the application share (Kwok 2013, section IV.C.1)."""

POLYPS = 10  # as printed
HOLD_S = 7.0  # a polyp disappears when it was viewed for so long, as printed; that it is in one piece is assumed
PROUD_MM = 2.0  # how far a polyp's middle stands out from the wall; not printed
