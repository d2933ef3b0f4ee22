"""The attack on the certificate: scenes, adversarial hands, and judges that share no code with the engine."""
