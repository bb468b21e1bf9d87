"""The pictures in the documents show the pages as they are."""

import json

import pictures
from conftest import PROGRAM


def test_pages_have_the_structure_of_their_pictures():
    now, then = pictures.structures(PROGRAM), json.loads(pictures.STRUCTURES.read_text("utf-8"))
    changed = sorted(view for view in now if now[view] != then.get(view))
    assert not changed, f"pictures of {', '.join(changed)} are old: make them again with tests/web/pictures.py"
