"""Fixtures for tests of the machine that judges."""

import pytest
from toy_paper import write_paper


@pytest.fixture
def toy(tmp_path):
    """The folder of the toy paper."""
    return write_paper(tmp_path / "papers" / "toy")
