"""The certificate of a snake: hard limits of joints and of the deviation over a whole motion."""
