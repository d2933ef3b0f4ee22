"""Distance fields: the distance to a surface on a grid, for what asks often and needs no exact answer."""
