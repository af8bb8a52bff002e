"""Checks what the strict build of the site does not: `python docs/site/check.py DIR`.

Pictures, files that are not pages, and what notebooks link to are there; every page is in the navigation; and the API page has every public
name of the Python package, which takes a docstring.
"""

import re
import sys
from pathlib import Path
from urllib.parse import unquote

import griffe

SITE = Path(sys.argv[1]).resolve()
TEXTS = {file: file.read_text(encoding="utf-8") for kind in ("html", "ipynb") for file in sorted(SITE.rglob(f"*.{kind}"))}


def links(file):
    if file.suffix == ".html":
        return re.findall(r'<[^>]*\s(?:href|src)="?([^"\s>]+)', TEXTS[file])
    found = re.findall(r"\]\(([^)\s]+)\)", TEXTS[file])
    return [re.sub(r"\.md\b", ".html", link.replace("README.md", "index.html")) for link in found]


def target(file, link):
    """The file that a link leads to, and the identifier of its place there."""
    path, _, fragment = unquote(link).partition("#")
    return (SITE / path[1:] if path.startswith("/") else file.parent / path if path else file).resolve(), fragment


def broken_links(file):
    for link in dict.fromkeys(links(file)):
        if re.match(r"[a-z]+:", link):
            continue
        leads_to, fragment = target(file, link)
        if not leads_to.is_file():
            yield f"{file.relative_to(SITE)}: {link} leads to no file of the site, which docs/site/run collects"
        elif fragment and leads_to in TEXTS and f'id="{fragment}"' not in TEXTS[leads_to]:
            yield f"{file.relative_to(SITE)}: {link} leads to no heading"


def outside_navigation():
    """The pages that 404.html, which has nothing but the navigation, does not link to."""
    start = SITE / "404.html"
    reached = {target(start, link)[0] for link in links(start)}
    for file in TEXTS:
        if file.suffix == ".html" and file != start and file not in reached:
            yield f"{file.relative_to(SITE)} is not in the navigation, `nav` of zensical.toml"


def public_names(path, parent):
    for name, member in parent.members.items():
        if member.is_public and not name.startswith("_"):
            yield f"{path}.{name}"
            if member.is_class:
                yield from public_names(f"{path}.{name}", member)


package = griffe.load("bristle", search_paths=["python"])
names = [name for module in (package, package["distributed"]) for name in public_names(module.path, module)]
api = TEXTS[SITE / "docs/api.html"]
wrong = [line for file in TEXTS for line in broken_links(file)]
wrong += outside_navigation()
wrong += [f"{name} has no docstring" for name in names if f'id="{name}"' not in api]
print("\n".join(wrong) if wrong else f"{len(TEXTS)} pages and notebooks, {len(names)} names of the Python package")
sys.exit(bool(wrong))
