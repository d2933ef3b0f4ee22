"""Anatomy: bone, airway, soft tissue and their surfaces, extracted from images; and the synthetic head."""
