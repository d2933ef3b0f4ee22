"""vfix_engine: virtual fixtures from anatomy, arrays in and arrays out.

One unit system everywhere: mm, rad, s, N.
One patient frame everywhere: DICOM LPS (x to the patient's left, y posterior, z superior).
Rotations are active; vectors are columns; transforms are named ``transform_<from>_to_<to>``.

The engine never imports the application, a web framework or a viewer.
"""

__version__ = "0.1.0"
