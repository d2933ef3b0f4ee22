"""The covariance tree of Li 2007, section III.D, as the paper describes it: a reference for the wide tree."""
