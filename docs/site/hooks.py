"""What mkdocs.yml cannot say: the navigation, which is that of README.md, and what differs between a code host's Markdown and that of MkDocs."""

import html
import os
import re
from pathlib import Path

# What scripts/docs generates, by tab: README.md does not list it.
GENERATED = {
    "Getting started": [{"Gallery": "gallery.md"}],
    "Reference": [{"Commands": "reference/commands.md"}, {"Python": "reference/python.md"}, {"C++": "reference/cpp/index.html"}],
}
OPTIONS = re.compile(r"^```yaml-options\n(.*?)^```$", re.MULTILINE | re.DOTALL)
OPTION = re.compile(r"(?P<indent> *)(?P<name>\w+)(?P<colon>:?) ?(?P<value>.*?) *(?:# (?P<help>.*))?$")


def on_startup(**_):
    """Types such as `float32, shape (N,)` in docstrings are text. Griffe would parse them as Python, and lose the comma."""
    from griffe._internal.docstrings import numpy

    numpy.parse_docstring_annotation = lambda annotation, *_, **__: annotation


def on_config(config):
    config.site_name = f"esim {os.environ['ESIM_VERSION']}"
    config.nav = [{"Home": "README.md"}, *navigation(Path(config.docs_dir, "README.md").read_text())]
    return config


def navigation(readme):
    """A tab for each heading below `## Documentation`; in it, lists below a line `NAME:` are sections."""
    tabs = []
    for part in readme.split("\n## Documentation\n")[1].split("\n## ")[0].split("\n### ")[1:]:
        heading, _, text = part.partition("\n")
        first, *sections = re.split(r"^(\w[\w ]*):\n\n", text, flags=re.MULTILINE)
        sections = [{name: pages_of(links)} for name, links in zip(sections[::2], sections[1::2])]
        tabs.append({heading: pages_of(first) + GENERATED.get(heading, []) + sections})
    return tabs


def pages_of(text):
    links = re.findall(r"\[([^]]+)\]\(([\w/-]+\.md)\)", text)
    return [{title[0].upper() + " ".join(title[1:].split()): page} for title, page in links]


def on_page_markdown(markdown, page, **_):
    markdown = OPTIONS.sub(lambda block: option_tables(block[1]), markdown)
    parts = re.split(r"(^```.*?^```$)", markdown, flags=re.MULTILINE | re.DOTALL)
    # A list directly below a paragraph, which Python's Markdown takes for a part of it.
    parts[::2] = [re.sub(r"^(?![-|>#\s]|\d+\. )(.*)\n(?=- |1\. )", r"\1\n\n", part, flags=re.MULTILINE) for part in parts[::2]]
    return "".join(parts)


def option_tables(listing):
    """The listing of `esim options` as tables, one for each group at the top, with an anchor for each option."""
    lines, path, anchors = ['<table class="options"><tbody>'], [], set()
    options = listing.splitlines()
    for line, following in zip(options, [*options[1:], ""]):
        option = OPTION.fullmatch(line)
        name, value, depth = option["name"], option["value"], len(option["indent"]) // 2
        path[depth:] = [value if name == "type" else name]
        anchor = ".".join(path)
        is_group = depth == 0 and following.startswith(" ")
        if is_group:
            lines += ["</tbody></table>", f"\n### {name}\n", '<table class="options"><tbody>']
        identifier = f' id="{anchor}"' if anchor not in anchors and not is_group else ""
        anchors.add(anchor)
        if name == "type":
            name, value = f"type: {value}", ""
        cells = [f'<td style="padding-left:{0.4 + depth}em"><code>{name}</code></td>', f"<td>{html.escape(value)}</td>"]
        lines.append(f"<tr{identifier}>{' '.join(cells)} <td>{html.escape(option['help'] or '')}</td></tr>")
    return "\n".join([*lines, "</tbody></table>"])
