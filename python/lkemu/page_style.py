"""Style of HTML reports: the style sheet of the dashboard, with rules for documents."""

from __future__ import annotations

import pathlib
import re

RULES = """
body { display: block; height: auto }
main { max-width: 1400px; margin: 0 auto; padding: 1rem; overflow: visible }
main > * { margin: 0 0 .8em }
h2 { margin-top: 1.6em }
svg { max-width: 100%; height: auto }
pre { overflow-x: auto }
@media screen and (max-width: 700px) { table { display: block; overflow-x: auto } }
@media print {
  :root { --ground: #fff }
  body { print-color-adjust: exact }
  tr, svg { break-inside: avoid }
  h2 { break-after: avoid }
  pre { white-space: pre-wrap; overflow-wrap: anywhere }
}
"""


def page_style() -> str:
    """Returns the style sheet. Pages follow the browser's choice of light or dark, and print in light colours."""
    package = pathlib.Path(__file__).resolve().parent
    for place in (package / "style.css", package.parents[1] / "web/style.css"):
        if place.is_file():
            style = place.read_text(encoding="utf-8")
            light = re.search(r':root\[data-theme="light"\] (\{.*?\})', style, re.DOTALL)
            return style + (f"@media (prefers-color-scheme: light), print {{ :root {light[1]} }}\n" if light else "") + RULES
    return RULES
