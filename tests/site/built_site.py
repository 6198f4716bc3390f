"""Where the built book is: build/html, or the folder that the variable SITE of the environment names."""

import os
from pathlib import Path

SITE = Path(os.environ.get("SITE") or Path(__file__).parents[2] / "build" / "html").resolve()
