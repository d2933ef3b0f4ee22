"""What an endoscope sees: the surface of air against tissue, the light that reaches it, and its colours."""
