"""The certificate of a snake: hard limits of joints and of the deviation during a whole motion."""
