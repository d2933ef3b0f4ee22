"""Shape conformance: joint angles that lay the robot along a curve (Kwok 2013, section IV)."""
