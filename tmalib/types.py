"""Names for the annotations of the library.

A field of a dataclass that is an `Array` holds an array of floats, read-only, and is made from anything that
NumPy makes one of: a list, a tuple, a number for each. To a type checker it is an array where it is read and
anything where it is given; the constructor checks it.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray: TypeAlias = NDArray[np.float64]
BoolArray: TypeAlias = NDArray[np.bool_]
IntArray: TypeAlias = NDArray[np.int_]
TextArray: TypeAlias = NDArray[np.str_]
Array: TypeAlias = FloatArray | Any
Seed: TypeAlias = int | np.random.SeedSequence | np.random.Generator
FilePath: TypeAlias = str | os.PathLike[str]
StateRows: TypeAlias = Sequence[FloatArray] | FloatArray  # one row a component


@runtime_checkable
class Motion(Protocol):
    """Where a platform or a target is: `tmalib.motion` has three.

    Models of conical angles also ask it for ``heading_at(t)``, in radians, and for a target's ``depth``.
    """

    def position_at(self, t: ArrayLike, /) -> FloatArray:
        """Position at the times ``t``, shape ``t.shape + (2,)``, in metres."""
        ...
