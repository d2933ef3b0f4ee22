"""What the body is: bone, airway, soft tissue and their surfaces, made from images; and the synthetic head."""
