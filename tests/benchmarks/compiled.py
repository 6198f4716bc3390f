"""The C kernels of this folder, compiled on the spot for the machine that they run on."""

import ctypes
import shutil
import subprocess
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

HERE = Path(__file__).parent
FLAGS = ("-O3", "-march=native", "-ffast-math", "-fopenmp-simd", "-shared", "-fPIC")
DOUBLES = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
INT, DOUBLE = ctypes.c_int, ctypes.c_double
ARGUMENTS = {
    "gauss_newton": [INT] * 4 + [DOUBLES] * 3 + [DOUBLE] * 3 + [DOUBLES] * 2,
    "ekf": [INT] * 2 + [DOUBLES] * 9,
}


@cache
def kernel(name):
    """The function of a kernel; `RuntimeError` without a C compiler, or if it does not compile."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        raise RuntimeError("no C compiler on the path")
    library = Path(mkdtemp()) / f"{name}.so"
    made = subprocess.run(
        [compiler, *FLAGS, HERE / f"{name}.c", "-o", library, "-lm"], capture_output=True, text=True
    )
    if made.returncode:
        raise RuntimeError(f"{compiler} does not compile {name}.c: {made.stderr}")
    function = getattr(ctypes.CDLL(str(library)), name)
    function.restype, function.argtypes = None, ARGUMENTS[name]
    return function
