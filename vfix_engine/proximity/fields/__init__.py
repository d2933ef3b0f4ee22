"""Distance fields: the distance to a surface sampled on a grid, for frequent queries that need no exact result."""
