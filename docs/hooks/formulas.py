"""Formulas between dollar signs become MathML, which browsers set by themselves: no script, no network.

`$...$` within a line, `$$...$$` as a block, which belongs to a list item where it is indented as that is. Fenced and
inline code is left alone.
"""

from __future__ import annotations

import html
import re
from typing import Any

from latex2mathml.converter import convert

CODE = re.compile(r"(^```.*?^```|^~~~.*?^~~~|`[^`\n]*`)", re.MULTILINE | re.DOTALL)
BLOCK = re.compile(r"^([ ]*)\$\$(.+?)\$\$", re.DOTALL | re.MULTILINE)
INLINE = re.compile(r"(?<![\\\w$])\$(?=\S)([^$\n]+?)(?<=\S)\$(?![\w$])")


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replace the formulas of a page."""
    parts = CODE.split(markdown)
    return "".join(part if i % 2 else _formulas(part) for i, part in enumerate(parts))


def _formulas(text: str) -> str:
    # A span, since Markdown takes a div within a list item for the end of the list.
    text = BLOCK.sub(lambda m: f'\n{m[1]}<span class="formula">{_mathml(m[2], "block")}</span>\n', text)
    # The span keeps Markdown from taking a formula at the start of a line for a block.
    return INLINE.sub(lambda m: f"<span>{_mathml(m[1], 'inline')}</span>", text)


def _mathml(latex: str, display: str) -> str:
    # Newlines would end the paragraph, and the source helps those who copy it.
    math = convert(" ".join(latex.split()), display=display).replace("\n", " ")
    return math.replace("<math ", f'<math aria-label="{html.escape(latex.strip(), quote=True)}" ', 1)
