"""A study with recorded tracks: bearings are simulated between real ships, and between real aircraft.

`records` reads the tracks, `encounters` cuts windows and chooses who watches whom, `trials` simulates, fits
and counts, `results` keeps what was counted and `shares` sums it up; `cases` says what is tried, `peer` how
Stone Soup does with the sample data of the library. `make study` runs all of it. The tables beside these
modules are what it left on the day that ``study.toml`` names, and all that the book reads; the recorded
tracks themselves are not in this repository.
"""
