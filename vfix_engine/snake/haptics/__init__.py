"""Forces on the hand of the operator."""
