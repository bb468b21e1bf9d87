"""Recipes of docs/campaigns-engines.md, so that tests run what people copy."""
import re


def blocks(page, heading, language):
    """The texts of the fenced blocks of a language below a heading of the second level."""
    section = re.search(rf"^## {re.escape(heading)}\n(.*?)(?=^## |\Z)", page.read_text("utf-8"), re.M | re.S)[1]
    return re.findall(rf"^```{language}\n(.*?)^```$", section, re.M | re.S)
