"""Checks the links of a site that its strict build does not: `python docs/site/links.py DIR`.

These are pictures, links to other files than pages, and the links of notebooks. A page that is not in the navigation is an error too.
"""

import re
import sys
from pathlib import Path
from urllib.parse import unquote

SITE = Path(sys.argv[1])
FILES = sorted([*SITE.rglob("*.html"), *SITE.rglob("*.ipynb")])
TEXTS = {file.resolve(): file.read_text(encoding="utf-8") for file in FILES}


def links(file):
    text = TEXTS[file.resolve()]
    if file.suffix == ".html":
        return re.findall(r'<[^>]*\s(?:href|src)="?([^"\s>]+)', text)
    found = re.findall(r"\]\(([^)\s]+)\)", text)
    return [re.sub(r"\.md\b", ".html", link.replace("README.md", "index.html")) for link in found]


def leads_nowhere(file, link):
    path, _, fragment = unquote(link).partition("#")
    target = (SITE / path[1:] if path.startswith("/") else file.parent / path if path else file).resolve()
    if not target.is_file():
        return "leads to no file of the site"
    if fragment and target in TEXTS and f'id="{fragment}"' not in TEXTS[target]:
        return "leads to no heading"


broken = [
    f"{file.relative_to(SITE)}: {link} {why}"
    for file in FILES
    for link in dict.fromkeys(links(file))
    if not re.match(r"[a-z]+:", link) and (why := leads_nowhere(file, link))
]
print("\n".join(broken) if broken else f"all lead somewhere, in {len(FILES)} pages and notebooks")
sys.exit(bool(broken))
