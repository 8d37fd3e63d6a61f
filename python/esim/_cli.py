"""The command `esim` of an installed package: runs the program in its folder."""

import os
import sys
from pathlib import Path

PROGRAM = Path(__file__).parent / "bin" / "esim"


def main():
    if not PROGRAM.is_file():
        sys.exit(f"esim: {PROGRAM} does not exist: this package was built without the program; install it with pip")
    os.execv(PROGRAM, ["esim", *sys.argv[1:]])
