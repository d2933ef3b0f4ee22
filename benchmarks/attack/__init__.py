"""The attack on every world: one campaign over ``System``, and for each world scenes, hostile inputs and an oracle."""
