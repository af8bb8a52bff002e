"""Extension of Python-Markdown for the site, where it differs from the Markdown of forges and from docstrings.

`$…$` and blocks between `$$` become MathML, which browsers show without a script. Examples at a Python prompt become code. In code, `\\|`
is the pipe that it stands for in a table.
"""

import xml.etree.ElementTree as etree

from markdown import Extension
from markdown.blockprocessors import BlockProcessor
from markdown.inlinepatterns import InlineProcessor
from markdown.util import AtomicString
from math_core import LatexToMathML
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import PythonConsoleLexer

# `\cr` ends a line in the documents, since Markdown takes `\\` for one backslash. An unknown command is an error.
CONVERTER = LatexToMathML(macros={"cr": r"\\"})


class Formula(InlineProcessor):
    def handleMatch(self, match, data):
        formula = CONVERTER.convert_with_local_state(match[1], displaystyle=False)
        return self.md.htmlStash.store(formula), match.start(), match.end()


class CodeWithPipe(InlineProcessor):
    def handleMatch(self, match, data):
        code = etree.Element("code")
        code.text = AtomicString(match[1].replace(r"\|", "|"))
        return code, match.start(), match.end()


class Html(BlockProcessor):
    """A block that becomes HTML as a whole."""

    def run(self, parent, blocks):
        etree.SubElement(parent, "p").text = self.parser.md.htmlStash.store(self.html(blocks.pop(0)))


class Formulas(Html):
    def test(self, parent, block):
        return block.startswith("$$\n") and block.endswith("\n$$")

    def html(self, block):
        return f'<div class="formulas">{CONVERTER.convert_with_local_state(block[3:-3], displaystyle=True)}</div>'


class Prompt(Html):
    def test(self, parent, block):
        return block.startswith(">>> ")

    def html(self, block):
        return highlight(block, PythonConsoleLexer(), HtmlFormatter(cssclass="highlight", wrapcode=True))


class Markup(Extension):
    def extendMarkdown(self, md):
        # Before and after code spans; before escapes, which would take the backslash of `\,`.
        md.inlinePatterns.register(CodeWithPipe(r"`([^`]*\\\|[^`]*)`", md), "code with pipe", 195)
        md.inlinePatterns.register(Formula(r"\$([^$]+)\$", md), "formula", 185)
        md.parser.blockprocessors.register(Formulas(md.parser), "formulas", 175)
        md.parser.blockprocessors.register(Prompt(md.parser), "prompt", 175)


def makeExtension(**_):
    return Markup()
