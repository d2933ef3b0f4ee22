"""A snake under attack: lumens, hands, parts that lie, and the oracle: the printed steps, without the query."""
