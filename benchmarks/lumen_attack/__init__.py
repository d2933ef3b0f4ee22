"""The attack on a snake's hard limits: lumens, hands that mean harm, and judges that share no line with the query."""
