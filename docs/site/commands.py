"""Prints the reference of the commands as Markdown, from their help: commands.py ESIM_PROGRAM"""

import html
import re
import subprocess
import sys


def table(rows):
    """Of lines `  TERM  MEANING`, where the meaning may follow in a line of its own."""
    lines = re.sub(r"(?<=\S)\n {20,}", "    ", rows).splitlines()
    cells = (re.split(r" {2,}", line.strip(), maxsplit=1) for line in lines)
    return "".join(f"<tr><td><code>{html.escape(term)}</code></td> <td>{html.escape(' '.join(meaning))}</td></tr>\n" for term, *meaning in cells)


def page(command, title):
    text = subprocess.run([*command, "--help"], check=True, capture_output=True, text=True).stdout
    _, *sections = re.split(r"\n\n+(?=\S[^\n]*:\n)", "\n\n" + text.strip() + "\n")
    usage = text.split("\n\n")[0].strip()
    print(f"\n## {title}\n\n{usage.splitlines()[0]}\n\n```text\n{usage.splitlines()[-1]}\n```")
    subcommands = []
    for section in sections:
        heading, _, rows = section.partition("\n")
        if heading.startswith("Example"):
            examples = re.sub(r"^  ", "", rows.rstrip(), flags=re.MULTILINE)
            print(f"\n**{heading}**\n\n```text\n{examples}\n```")
        else:
            rows, _, rest = rows.rstrip().partition("\n\n")
            print(f'\n**{heading}**\n\n<table class="options"><tbody>\n{table(rows)}</tbody></table>\n\n{rest}')
        if heading == "Subcommands:":
            subcommands = re.findall(r"^  (\w+)", rows, re.MULTILINE)
    return subcommands


def pages(command, title):
    for name in page(command, title):
        pages([*command, name], f"{title} {name}")


if __name__ == "__main__":
    print("# Commands\n\nThe help of each command: `esim COMMAND --help`.")
    pages([sys.argv[1]], "esim")
