"""The command ``tmalib``: from files to a target, to what a manoeuvre would give, to simulated bearings.

``tmalib fit`` reads an own ship's track and bearings (`tmalib.files` says how the tables look) and prints the
target with its standard deviations; ``tmalib bound`` prints what a planned track would tell of a supposed
target; ``tmalib simulate`` writes bearings of it. Angles are in degrees from true north, speeds in m/s; times
and places are as in the track: seconds or date-times, metres or latitude and longitude.

The exit code is 0; 1 where the target cannot be told, with the reason; 2 for input that cannot be used, with
one line on the standard error.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from . import status as words
from .batch import fit
from .bearings import Bearing, DelayedBearing
from .bounds import crlb, information_rank
from .estimate import Estimate
from .files import MAX_ROWS, load, read_bearings, read_track, save, write_bearings
from .files.clock import LEAST_UNIX_TIME, unix_seconds
from .files.frame import Frame
from .motion import Target
from .options import UNUSABLE, parse_options
from .pieces import FARTHEST
from .region import confidence_region
from .scenario import Scenario
from .seen import is_hardly_known
from .sensors import Sensor
from .summary import Row, as_text, at_reference, describe, summarise

ANSWERED, NOT_TOLD = 0, 1
TOLD = 50  # files after which it is said how many are written


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with the given arguments, those of the process by default; gives the exit code."""
    options = parse_options(sys.argv[1:] if arguments is None else arguments)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal may not have every sign
    try:
        return {"fit": _fit, "bound": _bound, "simulate": _simulate}[options.command](options)
    except OSError as error:
        fault = f"{error.filename}: {error.strerror}" if error.filename else error
    except (ValueError, ImportError) as error:
        fault = " ".join(str(error).split())
    print(f"tmalib {options.command}: {fault}", file=sys.stderr)
    return UNUSABLE


def _progress(text):
    """Say what is going on, to a person only."""
    if sys.stderr.isatty():
        print(f"{text} ...", file=sys.stderr, flush=True)


def _seconds(option, time, frame):
    """Seconds of a time that was given as in the track."""
    plain = time.kind == "number" and (frame.epoch is None or time.seconds < LEAST_UNIX_TIME)
    if plain != (frame.epoch is None):
        unix = f"a date-time, or a Unix time of {LEAST_UNIX_TIME} s or more"
        wanted = "plain seconds" if frame.epoch is None else unix
        raise ValueError(f"{option}: the track's times want {wanted}, got a {time.kind}: {time.seconds}")
    return float(time.seconds if plain else time.seconds - unix_seconds(frame.epoch))


def _frame(scenario):
    return getattr(scenario.platform, "frame", Frame())


def _as_wanted(scenario, options):
    """The scenario with the window and the reference time of the options, and the columns that are left."""
    frame, columns = _frame(scenario), np.arange(len(scenario.times))
    reference = scenario.reference_time
    if options.between:
        first, last = (_seconds("--between", time, frame) for time in options.between)
        columns = scenario.columns_between(first, last)
        scenario = scenario.between(first, last)
        reference = scenario.times.max()
    if options.reference:
        reference = _seconds("--reference", options.reference, frame)
    return replace(scenario, reference_time=reference), columns


# -- fit -------------------------------------------------------------------------------------------


def _fit(options):
    draw = _drawing() if options.figure else None
    _progress("reading")
    sigma = None if options.sigma is None else np.radians(options.sigma)
    ship = read_track(options.ownship)
    scenario, angles = read_bearings(options.bearings, ship, sigma=sigma, sound_speed=options.sound_speed)
    scenario, columns = _as_wanted(scenario, options)
    _progress(f"fitting {len(columns)} bearings")
    found = fit(scenario, angles[columns])
    print(as_text(summarise(found) + _origin(found.scenario) + _region(found)))
    if options.save:
        save(options.save, found)
    if draw:
        _progress("drawing")
        draw(found, options.figure)
    return ANSWERED if found.converged else NOT_TOLD


def _origin(scenario):
    """A row that says where x and y begin, if the track has latitudes and longitudes."""
    frame = _frame(scenario)
    if not frame.is_geographic:
        return []
    where = f"{frame.latitude:.6f}, {frame.longitude:.6f} degrees, the track's first fix"
    return [Row("x and y from", where)]


def _region(found):
    """A row of the ranges that the measurements allow, where the range is hardly known."""
    if not found.converged or not is_hardly_known(at_reference(found), found.scenario):
        return []
    _progress("looking for all ranges that are possible")
    region = confidence_region(found, 0.9)
    ends = [f"{far:.0f} m" if far < FARTHEST else "infinity" for far in region.ranges[:, 1]]
    ranges = [f"{near:.0f} m to {end}" for near, end in zip(region.ranges[:, 0], ends, strict=True)]
    return [Row("90 % region", f"ranges of {', '.join(ranges)}")]


def _drawing():
    """What draws a fit into a file, without a window; `ImportError` that says what to install."""
    try:
        import matplotlib as mpl  # imported here: an extra
    except ImportError:
        raise ImportError('--figure needs matplotlib: pip install "tmalib[figures]"') from None
    mpl.use("Agg")
    from matplotlib.pyplot import close

    from .situation import situation

    def draw(found, path):
        figure = situation(found)
        try:
            figure.savefig(path)
        finally:
            close(figure)

    return draw


# -- bound and simulate ----------------------------------------------------------------------------


def _planned(options):
    """The scenario of the options, with its target."""
    if (options.scenario is None) == (options.ownship is None):
        raise ValueError("give either SCENARIO.json or --ownship TRACK.csv")
    scenario = _planned_bearings(options) if options.ownship else _saved(options)
    scenario, _ = _as_wanted(scenario, options)
    if options.target:
        scenario = scenario.with_target(_target(options.target, scenario))
    if scenario.target is None:
        raise ValueError(f"{options.scenario} has no target; give --target")
    return scenario


def _saved(options):
    for name in ("every", "sigma", "sound_speed"):
        if getattr(options, name) is not None:
            raise ValueError(f"--{name.replace('_', '-')} goes with --ownship; a scenario has its own")
    scenario = load(options.scenario)
    if not isinstance(scenario, Scenario):
        raise ValueError(f"{options.scenario}: a Scenario is wanted, got a {type(scenario).__name__}")
    return scenario


def _planned_bearings(options):
    missing = [f"--{name}" for name in ("every", "sigma", "target") if getattr(options, name) is None]
    if missing:
        raise ValueError(f"with --ownship also give {', '.join(missing)}")
    ship = read_track(options.ownship)
    first, last = ship.times[[0, -1]]
    count = np.floor((last - first) / options.every * (1 + 1e-12)) + 1
    if count > MAX_ROWS:
        raise ValueError(
            f"--every {options.every:g} s makes {count:.0f} bearings, and at most {MAX_ROWS} are read"
        )
    times = np.minimum(first + options.every * np.arange(count), last)
    model = Bearing() if options.sound_speed is None else DelayedBearing(options.sound_speed)
    return Scenario(ship, [Sensor(model, times, np.radians(options.sigma))], times[-1])


def _target(numbers, scenario):
    """The target of ``--target``, at the first measurement."""
    x, y, speed, course, *depth = numbers
    frame, place = _frame(scenario), np.array([x, y])
    if frame.is_geographic:
        place = frame.to_plane(x, y)
    heading = np.radians(course) + frame.true_north(place)
    try:
        return Target(place, speed, heading, *depth, time=scenario.times.min())
    except ValueError as error:
        raise ValueError(f"--target: {error}") from None


def _bound(options):
    scenario = _planned(options)
    state = scenario.state
    rank = information_rank(scenario)
    if rank < len(state):
        why = f"{words.NOT_OBSERVABLE}: rank {rank} of {len(state)}. {words.ADVICE[words.NOT_OBSERVABLE]}"
        print(as_text([Row("status", why)]))
        return NOT_TOLD
    told = Estimate(scenario.reference_time, scenario.coordinates, state, crlb(scenario))
    rows = [*describe(told, scenario), *_origin(scenario), Row("measurements", str(len(scenario.times)))]
    print(as_text(rows))
    return ANSWERED


def _simulate(options):
    scenario, out = _planned(options), Path(options.out)
    paths = [out]
    if options.runs > 1:
        paths = [out.with_stem(f"{out.stem}-{k}") for k in range(1, options.runs + 1)]
    _progress(f"simulating {len(paths)} times {len(scenario.times)} bearings")
    for k, angles in enumerate(scenario.simulate(options.runs, options.seed)):
        if k and k % TOLD == 0:
            _progress(f"{k} of {len(paths)} files written")
        write_bearings(paths[k], scenario, angles)
    print(f"{len(scenario.times)} bearings in {', '.join(map(str, (paths[0], paths[-1])[: len(paths)]))}")
    return ANSWERED
