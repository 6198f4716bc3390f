"""`emw-acoustic`, FUSION 2016: bearings that arrive at once and bearings that arrive late."""
