"""The rigid tool under attack: scenes, hands, inputs past the hand, and the oracle: brute force and coal."""
