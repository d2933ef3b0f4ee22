"""The tool in a free hand: no robot, no certificate; bone answers as a spring, and penetration is counted."""
