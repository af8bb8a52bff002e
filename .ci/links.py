"""Checks that the relative links of the documents and notebooks lead to files and headings that exist."""

import glob
import json
import os
import re
import sys

DOCUMENTS = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", *glob.glob("*/README.md"), *glob.glob("*/*/README.md"), *glob.glob("docs/*.md"), *glob.glob("examples/notebooks/*.ipynb")]


def text_of(path):
    """The text of a document or notebook without its blocks of code."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    if path.endswith(".ipynb"):
        cells = json.loads(text)["cells"]
        text = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    return re.sub(r"```.*?```", "", text, flags=re.S)


def anchor(heading):
    """The anchor that GitHub gives a heading."""
    heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading.strip())
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def anchors(path):
    return {anchor(heading) for heading in re.findall(r"^#+ (.*)$", text_of(path), re.M)}


def broken_links(document):
    for link in re.findall(r"\]\(([^)\s]+)\)", text_of(document)):
        if re.match(r"https?:", link):
            continue
        path, _, fragment = link.partition("#")
        target = os.path.normpath(os.path.join(os.path.dirname(document), path)) if path else document
        if not os.path.exists(target):
            yield f"{document}: {link} leads to no file"
        elif fragment and target.endswith(".md") and fragment not in anchors(target):
            yield f"{document}: {link} leads to no heading"


documents = [path for path in DOCUMENTS if "node_modules" not in path]
broken = [line for document in documents for line in broken_links(document)]
print("\n".join(broken) if broken else f"all lead somewhere, in {len(documents)} documents")
sys.exit(bool(broken))
