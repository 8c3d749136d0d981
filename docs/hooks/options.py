"""An option of a command stays on one line: browsers break `--out` behind its hyphens."""

from __future__ import annotations

import re
from typing import Any

CONSOLE = re.compile(r'<div class="language-console.*?</div>', re.DOTALL)
OPTION = re.compile(r"(?<=</span>)--[a-z][a-z0-9-]*(?=[<\s])")


def on_page_content(html: str, **_: Any) -> str:
    """Mark the options of the console blocks of a page; the stylesheet does the rest."""
    return CONSOLE.sub(lambda block: OPTION.sub(r'<span class="option">\g<0></span>', block[0]), html)
