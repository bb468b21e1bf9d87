#!/usr/bin/python3
"""Draws the picture of docs/campaigns.md: picture.py REPORT [PNG], REPORT being what `lk-emu campaign quadruped --html REPORT`
writes. Needs python3-pil."""

import io
import pathlib
import sys

from page import Page
from PIL import Image

DOCS = pathlib.Path(__file__).resolve().parents[4] / "docs"
SHOWN = ["matrix", "space", "latency"]
BREADTH = 1640


def main(report, png):
    page = Page((BREADTH, 900))
    page.prefer("dark")
    page.show(pathlib.Path(report).resolve())
    # Side by side, and all of it: main is what scrolls.
    page.run("""
      document.querySelector('header').remove();
      for (const one of document.querySelectorAll('#main > section')) if (!arguments[0].includes(one.id)) one.remove();
      document.body.style.height = 'auto';
      document.querySelector('#main').style.cssText = 'display: grid; grid-template-columns: 62fr 38fr; gap: 12px';
      for (const one of document.querySelectorAll('#main > section')) one.style.cssText = 'margin: 0; max-width: none';
      document.querySelector('#space').style.gridArea = '1 / 2 / 3 / 3';""", SHOWN)
    page.resize(BREADTH, page.run("return document.documentElement.scrollHeight"))
    page.drawn()
    picture = Image.open(io.BytesIO(page.driver.get_screenshot_as_png())).convert("RGB")
    page.close()
    picture.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(png, optimize=True)


main(sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else DOCS / "pictures/campaign.png")
