"""The covariance tree as described in Li 2007, section III.D: a reference for the 16-wide tree."""
