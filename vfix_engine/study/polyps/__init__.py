"""Study I of Kwok 2013, section IV.C.1: polyps on a colon's wall that are looked at through a robot's camera.

Pure functions over immutable values; the drive knows nothing of them.
"""
