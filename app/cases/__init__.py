"""Cases: a patient's head with its surfaces, volumes, structures and settings."""
