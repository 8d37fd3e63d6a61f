"""The command `esim` of an installed package, also as `python -m esim`: runs the program in the package's folder."""

import os
import sys
from pathlib import Path

PROGRAM = Path(__file__).parent / "bin" / "esim"


def main():
    if not PROGRAM.is_file():
        sys.exit(f"esim: {PROGRAM} does not exist: install the package with pip, which includes the program")
    # The program runs interpolators in this Python, which has their packages (esim video --interpolator).
    os.execve(PROGRAM, ["esim", *sys.argv[1:]], {"ESIM_PYTHON": sys.executable, **os.environ})


if __name__ == "__main__":
    main()
