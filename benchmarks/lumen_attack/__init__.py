"""The attack on a snake's hard limits: lumens, adversarial hands, and judges that share no code with the query."""
