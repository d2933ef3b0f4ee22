"""Studies of real people, led on the page: the order is followed, and the runs are noted."""
