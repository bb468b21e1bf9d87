"""Extracts recipes from docs/campaigns-engines.md, so that tests run the commands that users copy."""
import re


def blocks(page, heading, language):
    """Returns the texts of the fenced blocks of a language below a second-level heading."""
    section = re.search(rf"^## {re.escape(heading)}\n(.*?)(?=^## |\Z)", page.read_text("utf-8"), re.M | re.S)[1]
    return re.findall(rf"^```{language}\n(.*?)^```$", section, re.M | re.S)
