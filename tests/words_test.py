"""Sources and documentation use the words of the field: none of those in words.txt.

Run as: words_test.py PROJECT_FOLDER
"""

import os
import pathlib
import re
import sys

ROOT = pathlib.Path(sys.argv[1])
LIST = ROOT / "tests" / "words.txt"
SUFFIXES = {".h", ".cpp", ".c", ".py", ".pyi", ".md", ".txt", ".cmake", ".yaml", ".yml", ".ts", ".mjs", ".css", ".html", ""}
LEFT_OUT = {"tests/words.txt", "tests/words_test.py", "CHANGELOG.md", "studio/package-lock.json", "LICENSE"}
GENERATED = {"build", "dist", "node_modules", "out", "__pycache__"}
LEFT_OUT_FOLDERS = ("tests/fuzz/corpus/",)  # of damaged files


def read_list():
    entries = []
    for number, line in enumerate(LIST.read_text().splitlines(), 1):
        if line.startswith("#") or not line:
            continue
        words, tab, use = line.partition("\t")
        if not tab or not use:
            sys.exit(f"{LIST}:{number}: expected WORDS<tab>WHAT TO USE")
        entries.append((re.compile(rf"\b(?:{words})\b", re.IGNORECASE), use))
    return entries


def sources():
    for folder, folders, files in os.walk(ROOT):
        folders[:] = sorted(name for name in folders if name not in GENERATED and not name.startswith(".git"))
        yield from (pathlib.Path(folder) / name for name in sorted(files))


def main():
    entries = read_list()
    every = re.compile("|".join(pattern.pattern for pattern, _ in entries), re.IGNORECASE)
    problems = []
    for path in sources():
        name = str(path.relative_to(ROOT))
        if name in LEFT_OUT or name.startswith(LEFT_OUT_FOLDERS) or path.suffix not in SUFFIXES or not path.is_file():
            continue
        try:
            text = path.read_text()
        except UnicodeDecodeError:
            continue
        if not every.search(text):
            continue
        for number, line in enumerate(text.splitlines(), 1):
            for pattern, use in entries:
                for found in pattern.finditer(line):
                    if found.group().endswith("None"):  # Python's
                        continue
                    problems.append(f"{name}:{number}: '{found.group()}': write: {use}")
    if problems:
        sys.exit("\n".join(problems) + f"\n{len(problems)} words that tests/words.txt lists")


if __name__ == "__main__":
    main()
