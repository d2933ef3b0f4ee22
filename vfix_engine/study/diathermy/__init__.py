"""Focal diathermy along straight lines in a cavity: study II of Kwok 2013, section IV.C.2."""
