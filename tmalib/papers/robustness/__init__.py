"""`robustness`, FUSION 2008: what small departures from straight motion do to the track."""
