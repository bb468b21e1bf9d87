"""Accessibility: no findings of axe-core on any page, contrast of borders, size of targets, names of controls."""

import pathlib

import pytest
from dashboard import settle

AXE = (pathlib.Path(__file__).parent / "vendor" / "axe.min.js").read_text("utf-8")
VIEWS = ("bus", "scope", "traffic", "bench")
SIZES = [(1920, 1080), (1440, 900), (768, 1024), (390, 844)]
THEME = "document.documentElement.dataset.theme = arguments[0]; document.dispatchEvent(new Event('theme'))"

# WCAG 2.2 A and AA, best practices, and the experimental rule that names contain the visible text.
FINDINGS = """
  const done = arguments[arguments.length - 1];
  const tags = ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice'];
  axe.run(document, {resultTypes: ['violations'], runOnly: {type: 'tag', values: tags}, rules: {'label-content-name-mismatch': {enabled: true}}})
    .then(({violations}) => done(violations.flatMap(({id, nodes}) => nodes.map(({html}) => `${id}: ${html.slice(0, 120)}`))));"""

# Contrast by WCAG 2: of the border, or else of the area, with what is behind the control.
FAINT = """
  const pen = Object.assign(document.createElement('canvas'), {width: 1, height: 1}).getContext('2d', {willReadFrequently: true});
  const pixel = (...colours) => {
    pen.clearRect(0, 0, 1, 1);
    for (const colour of colours) {
      pen.fillStyle = colour;
      pen.fillRect(0, 0, 1, 1);
    }
    return pen.getImageData(0, 0, 1, 1).data;
  };
  const luminance = (rgba) => [0.2126, 0.7152, 0.0722].reduce((sum, weight, n) => {
    const c = rgba[n] / 255;
    return sum + weight * (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  }, 0);
  const contrast = (a, b) => {
    const [most, least] = [luminance(a), luminance(b)].sort((x, y) => y - x);
    return (most + 0.05) / (least + 0.05);
  };
  const areas = (node) => (node ? [...areas(node.parentElement), getComputedStyle(node).backgroundColor] : []);
  return [...document.querySelectorAll('button, input:not([type=checkbox], [type=range], [type=file]), select, textarea')]
    .filter((node) => node.offsetParent && !node.matches(':disabled, .quiet, .plot-legend *, .values *'))
    .map((node) => {
      const behind = areas(node.parentElement);
      const style = getComputedStyle(node);
      return [contrast(pixel(...behind, style.borderTopColor), pixel(...behind)), node.outerHTML.slice(0, 100)];
    })
    .filter(([ratio]) => ratio < 3);"""

SMALL = """
  return [...document.querySelectorAll('a, button, input, select, textarea, summary')].map((node) => {
    const {left, width, height} = (node.type === 'checkbox' ? node.closest('label') : node).getBoundingClientRect();
    return [width, height, node.outerHTML.slice(0, 100), left];
  }).filter(([width, height, , left]) => width && left >= 0 && (width < 23.95 || height < 23.95));"""

NAMELESS = """
  return [...document.querySelectorAll('[aria-label]:is(a, button)')].map((node) => [node.textContent.trim(), node.getAttribute('aria-label')])
    .filter(([text, name]) => /\\p{L}/u.test(text) && !name.toLowerCase().includes(text.toLowerCase()));"""


@pytest.fixture(scope="module", params=["en", "zh"])
def filled(bench, browser, request):
    """A page with contents: frames, a fault, all of the scope's controls."""
    from dashboard import Page
    page = Page(browser, bench.http, query=f"?lang={request.param}")
    page.run(AXE)
    page.run("""return fetch('/api/v1/directives', {method: 'POST', headers: {'Content-Type': 'application/json'},
      body: '{"id": 2, "fault": "jam"}'}).then((answer) => answer.status)""")
    for view in VIEWS:
        page.go(view)
        page.drawn()
    page.run("for (const one of document.querySelectorAll('details')) one.open = true")
    page.go("traffic")
    bench.ask(1, 0x9A)
    bench.ask(2, 0x9C)
    settle(page, lambda: len(page.all("#view-traffic tbody tr")) >= 4)
    page.go("bench")
    settle(page, lambda: page.all("#evidence [data-fault]"))
    page.go("scope")
    settle(page, lambda: page.all(".plot-legend button"))
    page.choose(".scope-controls select:has([value=single])", "auto")
    yield page
    page.run(THEME, "dark")
    page.run("""return fetch('/api/v1/directives', {method: 'POST', headers: {'Content-Type': 'application/json'},
      body: '{"clear": "all"}'}).then((answer) => answer.status)""")
    page.resize((1440, 900))
    page.close()


def on_each_view(page, check):
    found = {}
    for view in VIEWS:
        page.go(view)
        page.drawn()
        found[view] = check()
    return {view: some for view, some in found.items() if some}


@pytest.mark.parametrize("size", SIZES, ids=lambda size: str(size[0]))
def test_axe_finds_nothing(filled, size):
    filled.resize(size)
    filled.run(THEME, "light" if size[0] == 1440 else "dark")
    assert on_each_view(filled, lambda: filled.driver.execute_async_script(FINDINGS)) == {}


def test_axe_finds_nothing_in_the_dialog(filled):
    filled.run("const dialog = document.querySelector('dialog'); dialog.querySelector('.wrong').hidden = false; dialog.showModal()")
    try:
        assert filled.driver.execute_async_script(FINDINGS) == []
    finally:
        filled.run("document.querySelector('dialog').close()")


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_borders_of_controls_are_visible(filled, theme):
    filled.run(THEME, theme)
    filled.run("document.head.append(Object.assign(document.createElement('style'), {textContent: '* {transition: none !important}'}))")
    assert on_each_view(filled, lambda: filled.run(FAINT)) == {}


@pytest.mark.parametrize("size", [SIZES[1], SIZES[3]], ids=lambda size: str(size[0]))
def test_targets_have_24_px(filled, size):
    filled.resize(size)
    assert on_each_view(filled, lambda: filled.run(SMALL)) == {}


def test_names_contain_the_visible_text(filled):
    assert on_each_view(filled, lambda: filled.run(NAMELESS)) == {}
