"""Hook of the site: equations become MathML when it is built, so that pages need neither scripts nor the network."""

from __future__ import annotations

import html
import re
from typing import Any

from latex2mathml.converter import convert

DISPLAY = re.compile(r'<pre><code class="language-math">(.*?)</code></pre>', re.DOTALL)
PIPE = re.compile(r"(<td[^>]*>)(.*?)(?=</td>)", re.DOTALL)
INLINE = re.compile(r"\$<code>(.*?)</code>\$", re.DOTALL)


def on_page_content(content: str, **_: Any) -> str:
    """Return a page's HTML with its equations converted.

    As on GitHub, equations of their own stand in fences called ``math``, and inline ones in code spans between dollar signs.
    """
    # A pipe in a table is escaped for GitHub, and here not needed.
    content = PIPE.sub(lambda found: found[1] + found[2].replace("\\|", "|"), content)
    content = DISPLAY.sub(lambda found: convert(html.unescape(found[1]).strip(), display="block"), content)
    return INLINE.sub(lambda found: convert(html.unescape(found[1])), content)
