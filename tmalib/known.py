"""What is known of a component of the state beforehand, as a measurement of it.

A Gaussian prior on a component, independent of all else, with mean mu and standard deviation s adds::

    ((mu - component) / s)^2

to the criterion: just what a measurement of the component with the value mu and the standard deviation s
does. So bounds and the batch estimate take it as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .types import FloatArray, Motion, StateRows


@dataclass(frozen=True)
class KnownComponent:
    """A component of the state, measured: a measurement model for a prior on it.

    Parameters
    ----------
    name : str
        ``"z"`` for a depth, the name of a further unknown (``"bias"``), or one of ``x, y, vx, vy`` at the
        reference time.
    truth_value : float, optional
        What `Scenario.simulate` takes as true; needed for any component but the depth of a target.

    Raises
    ------
    ValueError
        For a name that is no text.

    Notes
    -----
    Give it to a `Sensor` with one time, any of those measured, and the standard deviation of the prior; its
    measurement is the prior's mean. `Scenario.simulate` draws a mean about the truth; for a mean of one's
    own put it in its place.

    Examples
    --------
    >>> import numpy as np, tmalib as tma
    >>> array = tma.Course((0, 0), speed=0, heading=0.0, legs=[tma.Straight(300)])
    >>> rays = [tma.ConicalAngle(path, 200.0, 2000.0) for path in (tma.DIRECT, tma.BOTTOM_BOUNCE)]
    >>> sensors = [tma.Sensor(ray, np.arange(0, 301, 4.0), 0.017) for ray in rays]
    >>> target = tma.Target((5000, 7000), speed=4, heading=0.8, depth=100)
    >>> depth = tma.Sensor(tma.KnownComponent("z"), [0.0], 100.0, "depth")
    >>> for known in ([], [depth]):
    ...     print(f"{tma.crlb_sigma(tma.Scenario(array, sensors + known, 0, target))[2]:.1e} m")
    8.5e+05 m
    1.0e+02 m
    """

    name: str
    truth_value: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise ValueError(f"name must be that of a component of the state, got {self.name!r}")

    @property
    def coordinates(self) -> tuple[str, ...]:
        return (self.name,)

    def observer_state(self, platform: Motion, times: FloatArray) -> FloatArray:
        """Nothing of the platform matters, shape ``(1, N)``."""
        return np.zeros((1, len(times)))

    def value_and_gradient(
        self, state: StateRows, observer: FloatArray, elapsed: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        value = state[0] + 0 * (observer[0] + elapsed)
        return value, np.ones((1, *value.shape))

    def residual(self, measured: FloatArray, predicted: FloatArray) -> FloatArray:
        """Plain difference."""
        return measured - predicted

    def observe(self, target: Motion, platform: Motion, times: FloatArray) -> FloatArray:
        """The true value, shape ``(N,)``."""
        value = self.truth_value if self.truth_value is not None else getattr(target, "depth", None)
        if value is None or (self.truth_value is None and self.name != "z"):
            raise ValueError(f"the true {self.name} is not known; give KnownComponent(truth_value=...)")
        return np.full(len(times), float(value))
