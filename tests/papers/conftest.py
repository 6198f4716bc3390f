import pytest

from tmalib.papers.robustness import scenarios


@pytest.fixture(scope="module")
def geometry():
    """The reference geometry of `robustness`: the straight target and the disturbed ones."""
    return scenarios.reference()
