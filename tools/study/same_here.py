"""The bearings of `tmalib.samples` tracked by this library: what `stone_soup.py` does with one filter."""

import tmalib as tma
from tmalib.samples import sample

ship = tma.read_track(sample("ownship.csv"))
watch, angles = tma.read_bearings(sample("bearings.csv"), platform=ship)
found = tma.fit(watch, angles)
print(found)
