"""The options of the command ``tmalib``, read and checked one by one."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from .checks import check_count
from .files.clock import parse_time
from .files.tables import number_cell

UNUSABLE = 2  # exit code
PLAN = "--ownship plan.csv --every 10 --sigma 1 --target 4000,6000,5,270"
EXAMPLES = {
    "fit": "tmalib fit bearings.csv --ownship track.csv --sigma 1 --figure target.svg",
    "bound": f"tmalib bound {PLAN}",
    "simulate": f"tmalib simulate {PLAN} --out bearings.csv",
}


def parse_options(arguments: Sequence[str]) -> argparse.Namespace:
    """The options of a list of arguments, their ``command`` among them.

    Exits with 0 after ``--help``, and with 2 and a line on the standard error for what is none.
    """
    return _parser().parse_args(_with_negative_targets(arguments))


def _with_negative_targets(arguments):
    """``--target -5,2`` as ``--target=-5,2``: else the minus would begin another option."""
    joined = []
    for word in arguments:
        if joined and joined[-1] == "--target":
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


class _Parser(argparse.ArgumentParser):
    def error(self, message):
        self.exit(UNUSABLE, f"{self.prog}: {message}; see {self.prog} --help\n")


def _of(parse):
    """A parser of texts as the type of an option, with its message."""

    def convert(text):
        try:
            return parse(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return convert


def _numbers(text):
    """The numbers of ``--target``."""
    numbers = [number_cell()(part.strip()) for part in text.split(",")]
    if len(numbers) not in (4, 5):
        raise ValueError(f"X,Y,SPEED,COURSE or X,Y,SPEED,COURSE,DEPTH is wanted, got {text!r}")
    return numbers


SIGMA = _of(number_cell(above=0, maximum=180, unit=" degrees"))
SOUND_SPEED = _of(number_cell(100, 10_000, " m/s"))
INTERVAL = _of(number_cell(above=0, unit=" s"))
TIME = _of(parse_time)


def _count(text):
    if not text.isdecimal():
        raise ValueError(f"a positive integer is wanted, got {text!r}")
    return check_count("the number", int(text))


def _seed(text):
    if not text.isdecimal():
        raise ValueError(f"a whole number from 0 on is wanted, got {text!r}")
    return int(text)


def _add(commands, name, what):
    example = f"example: {EXAMPLES[name]}"
    style = argparse.RawDescriptionHelpFormatter
    return commands.add_parser(name, help=what, description=f"{what.capitalize()}.", epilog=example,
                               formatter_class=style, allow_abbrev=False)  # fmt: skip


def _parser():
    parser = _Parser(
        prog="tmalib",
        description="Target motion analysis from bearings. Angles in degrees, speeds in m/s.",
        epilog="examples: " + "\n          ".join(EXAMPLES.values()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    commands = parser.add_subparsers(metavar="{fit,bound,simulate}", dest="command", required=True)
    fit = _add(commands, "fit", "estimate the target from measured bearings")
    bound = _add(commands, "bound", "tell how well a planned track would show a target")
    simulate = _add(commands, "simulate", "write bearings of a target to a file")
    fit.add_argument("bearings", metavar="BEARINGS.csv", help="time, bearing, sigma, sensor; or a REP file")
    fit.add_argument(
        "--ownship",
        metavar="TRACK.csv",
        required=True,
        help="time; x, y or latitude, longitude; or a REP file",
    )
    fit.add_argument("--sigma", metavar="DEG", type=SIGMA, help="of bearings that have none in the file")
    fit.add_argument("--figure", metavar="FILE", help="draw map and residuals: .svg, .pdf, .png")
    fit.add_argument("--save", metavar="FILE.json", help="keep the result, for tmalib.load")
    for one in (bound, simulate):
        _add_plan(one)
    simulate.add_argument("--runs", metavar="N", type=_of(_count), default=1, help="files to write (1)")
    simulate.add_argument("--seed", metavar="K", type=_of(_seed), default=0, help="of the noise (0)")
    simulate.add_argument(
        "--out", metavar="FILE.csv", required=True, help="of several runs FILE-1.csv to FILE-N.csv"
    )
    for one in (fit, bound, simulate):
        one.add_argument("--reference", metavar="TIME", type=TIME, help="of the state (the last bearing)")
        one.add_argument(
            "--between", metavar=("T0", "T1"), nargs=2, type=TIME, help="use only these bearings"
        )
        one.add_argument(
            "--sound-speed",
            metavar="M/S",
            type=SOUND_SPEED,
            help="bearings are delayed by the way of the sound",
        )
    return parser


def _add_plan(parser):
    """What makes a scenario with a target."""
    parser.add_argument(
        "scenario", metavar="SCENARIO.json", nargs="?", help="from tmalib.save; or else --ownship and so on"
    )
    parser.add_argument("--ownship", metavar="TRACK.csv", help="the planned track")
    parser.add_argument("--every", metavar="S", type=INTERVAL, help="seconds between two bearings")
    parser.add_argument("--sigma", metavar="DEG", type=SIGMA, help="standard deviation of a bearing")
    parser.add_argument(
        "--target", metavar="X,Y,SPEED,COURSE[,DEPTH]", type=_of(_numbers),
        help="at the first bearing; LATITUDE,LONGITUDE for X,Y where the track has them",
    )  # fmt: skip
