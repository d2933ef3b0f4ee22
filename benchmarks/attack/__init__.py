"""The attack on the certificate: scenes, hands that mean harm, and judges that share no line with the engine."""
