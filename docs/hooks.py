"""Hooks of the site: when it is built, equations become MathML and notebooks pages. Neither needs scripts or the network."""

from __future__ import annotations

import html
import re
from pathlib import PurePosixPath
from typing import Any

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from nbconvert import MarkdownExporter

DISPLAY = re.compile(r'<pre><code class="language-math">(.*?)</code></pre>', re.DOTALL)
PIPE = re.compile(r"(<td[^>]*>)(.*?)(?=</td>)", re.DOTALL)
SHOWN = ["text/html", "image/svg+xml", "image/png", "text/plain"]
"""Of an output that is there in several forms the first is shown."""
INLINE = re.compile(r"\$<code>(.*?)</code>\$", re.DOTALL)


def on_page_content(content: str, **_: Any) -> str:
    """Return a page's HTML with its equations converted.

    As on GitHub, equations of their own stand in fences called ``math``, and inline ones in code spans between dollar signs.
    """
    # A pipe in a table is escaped for GitHub, and here not needed.
    content = PIPE.sub(lambda found: found[1] + found[2].replace("\\|", "|"), content)
    content = DISPLAY.sub(lambda found: convert(html.unescape(found[1]).strip(), display="block"), content)
    return INLINE.sub(lambda found: convert(html.unescape(found[1])), content)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a page for each notebook, with its outputs as they are in the file, and the pictures beside it."""
    for file in list(files):
        if not file.src_uri.endswith(".ipynb"):
            continue
        place = PurePosixPath(file.src_uri)
        exporter = MarkdownExporter(config={"NbConvertBase": {"display_data_priority": SHOWN}})
        resources = {"output_files_dir": "", "unique_key": place.stem}
        text, made = exporter.from_filename(file.abs_src_path, resources=resources)
        text += f"\n\nThis page is the notebook [{place.name}]({place.name}).\n"
        files.append(File.generated(config, str(place.with_suffix(".md")), content=text))
        for name, content in made["outputs"].items():
            files.append(File.generated(config, str(place.parent / name), content=content))
    return files
