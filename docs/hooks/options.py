"""An option of a command stays on one line: browsers break `--out` behind its hyphens."""

from __future__ import annotations

import re
from typing import Any

CONSOLE = re.compile(r'<div class="language-console.*?</div>', re.DOTALL)
OPTION = re.compile(r"(?<=</span>)--[a-z][a-z0-9-]*(?=[<\s])")
WITHIN_TEXT = re.compile(r"(?<=<code>)--[a-z][a-z0-9-]*")
MARKED = r'<span class="option">\g<0></span>'


def on_page_content(html: str, **_: Any) -> str:
    """Mark the options of a page, in console blocks and within its text; the stylesheet does the rest."""
    html = CONSOLE.sub(lambda block: OPTION.sub(MARKED, block[0]), html)
    return WITHIN_TEXT.sub(MARKED, html)
