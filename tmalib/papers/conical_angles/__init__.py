"""`conical-angles`, Sensors 2021: a towed array and cosines of conical angles."""
