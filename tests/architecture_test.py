"""Applies every rule of architecture_rules.py to the project.

Run as: architecture_test.py PROJECT_FOLDER
"""

import pathlib
import sys

from architecture_rules import RULES


def main():
    root = pathlib.Path(sys.argv[1])
    problems = [problem for rule in RULES for problem in rule(root)]
    if problems:
        sys.exit("\n".join(problems) + f"\n{len(problems)} problems; ARCHITECTURE.md and tests/architecture_rules.py say why")


if __name__ == "__main__":
    main()
