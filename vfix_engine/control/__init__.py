"""Control: admittance law, one QP, certificate, explanation."""
