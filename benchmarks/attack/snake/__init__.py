"""A snake under attack: lumens, operators, parts that lie, and the oracle: the printed steps, without the query."""
