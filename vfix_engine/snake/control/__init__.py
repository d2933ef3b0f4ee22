"""Control of the tip and of the parameterised bend, and the rows that the wall gives to a quadratic program."""
