"""The parts of the head as data: millimetres, left side, origin at the anterior nasal spine."""
