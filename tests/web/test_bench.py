"""Tests the bench: no text is cut, clickable elements are not covered, and unselected drives are not shown."""

import pytest
from dashboard import settle

SIZES = [(768, 1024), (1280, 800), (1920, 1080)]


@pytest.fixture(params=SIZES, ids=lambda size: str(size[0]))
def sized(page, request):
    page.go("bench")
    page.resize(request.param)
    page.drawn()
    yield page
    page.resize((1440, 900))


def test_no_label_is_cut(sized):
    """Checks labels and placeholders for every fault."""
    cut = sized.run("""
      const pen = document.createElement('canvas').getContext('2d');
      const select = document.querySelector('#fault-kind');
      const cut = new Set();
      for (const option of select.options) {
        select.value = option.value;
        select.dispatchEvent(new Event('change'));
        for (const text of document.querySelectorAll('#view-bench label, #view-bench label span, #view-bench h2, #view-bench button')) {
          if (text.scrollWidth > text.clientWidth + 1 && text.clientWidth) cut.add(text.textContent);
        }
        for (const field of document.querySelectorAll('#view-bench input[placeholder]')) {
          const style = getComputedStyle(field);
          pen.font = `${style.fontSize} ${style.fontFamily}`;
          const room = field.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight) - 18;  // its arrows
          if (pen.measureText(field.placeholder).width > room) cut.add(field.placeholder);
        }
      }
      return [...cut];""")
    assert cut == []


@pytest.mark.parametrize("size", [(1280, 720), (1440, 900), (1920, 1080), (2560, 1440)], ids=lambda size: str(size[0]))
def test_panels_fill_two_columns(page, size):
    """Without holes, for a fault with few and with many parameters."""
    page.go("bench")
    page.resize(size)
    try:
        for kind in ("cut", "friction"):
            page.choose("#fault-kind", kind)
            page.drawn()
            boxes = page.run("return [...document.querySelectorAll('.bench > .panel')].map((one) => one.getBoundingClientRect().toJSON())")
            assert len(boxes) == 8
            left = sorted((one for one in boxes if one["left"] < size[0] / 2), key=lambda one: one["top"])
            right = sorted((one for one in boxes if one["right"] > size[0] / 2), key=lambda one: one["top"])
            assert len({one["left"] for one in left}) == len({one["right"] for one in right}) == 1
            for column in (left, right):
                assert all(0 < below["top"] - above["bottom"] <= 24 for above, below in zip(column, column[1:]))
            assert abs(left[-1]["bottom"] - right[-1]["bottom"]) <= 24
            narrow = [one["width"] for one in boxes if one["width"] < size[0] * 0.6]
            assert len(narrow) == 6 and max(narrow) - min(narrow) < 1
    finally:
        page.resize((1440, 900))


@pytest.mark.parametrize("size", [(768, 1024), (390, 844)], ids=lambda size: str(size[0]))
def test_narrow_bench_has_one_column(page, size):
    page.go("bench")
    page.resize(size)
    try:
        page.drawn()
        assert page.run("return new Set([...document.querySelectorAll('.bench > .panel')].map((one) => one.offsetLeft)).size") == 1
        assert page.run("return document.querySelector('main').scrollWidth") <= size[0]
    finally:
        page.resize((1440, 900))


def test_every_button_has_a_unique_name(page):
    page.go("bench")
    names = page.run("""return [...document.querySelectorAll('#view-bench .panel button')].filter((one) => !one.closest('table'))
      .map((one) => one.getAttribute('aria-label') ?? one.textContent)""")
    assert sorted(names) == sorted(set(names))
    assert "Stop" not in names, "of what?"


def run_jammed_joint(page):
    jammed = '#scenario option[value$="jammed_joint.toml"]'
    settle(page, lambda: page.all(jammed))
    page.choose("#scenario", page.one(jammed).get_attribute("value"))
    page.click("#view-bench", "Start scenario")
    settle(page, lambda: page.all(".scenario-panel tbody tr"))


def stop_scenario(page):
    """Ends a scenario that still runs."""
    page.run("return fetch('/api/v1/scenario', {method: 'DELETE'}).then((answer) => answer.status)")
    settle(page, lambda: not page.button("#view-bench", "Stop scenario").is_enabled())


def test_scenario_has_room_and_other_panels_stay_compact(sized):
    """The table is next to its controls or below them; panels are at most 1.5 times as tall as their contents."""
    run_jammed_joint(sized)
    try:
        table, panel, empty = sized.run("""
          const high = (node) => node.getBoundingClientRect().height;
          const panels = [...document.querySelectorAll('.bench > .panel')];
          const empty = panels.filter((panel) => high(panel) > 1.5 * (high(panel.querySelector('h2')) + high(panel.querySelector('fieldset')) + 40));
          const wide = (css) => document.querySelector(css).getBoundingClientRect().width;
          return [wide('.scenario-panel table'), wide('.bench'), empty.map((panel) => panel.ariaLabel)];""")
        assert table > 0.6 * panel
        assert empty == []
    finally:
        stop_scenario(sized)


def test_scenario_for_another_robot_shows_a_warning(page):
    """jammed_joint is made for robots/joint.toml with one MG8016; the drives here are MF7015."""
    page.go("bench")
    run_jammed_joint(page)
    try:
        settle(page, lambda: "Written for another robot, robots/joint.toml" in page.text("#scenario-robot"))
        assert "drive 1 is mg8016 there, mf7015 here" in page.text("#scenario-robot")
        assert page.one("#scenario-robot").is_displayed()
    finally:
        stop_scenario(page)


def test_notes_cover_no_button(sized):
    sized.for_drives(2)
    sized.choose("#fault-kind", "friction")
    sized.fill('#fault-parameters [data-key="factor"]', 2)
    for _ in range(2):
        sized.click("#view-bench", "Inject")
        settle(sized, lambda: "injected" in " ".join(note.text for note in sized.all(".note")))
    settle(sized, lambda: sized.all("#evidence tbody button:enabled"))
    covered = sized.run("""
      const under = (button) => {
        button.scrollIntoView({block: 'end'});
        const {left, top, width, height} = button.getBoundingClientRect();
        return document.elementFromPoint(left + width / 2, top + height / 2)?.closest('button') !== button;
      };
      return [...document.querySelectorAll('#view-bench button')].filter((button) => button.offsetParent && !button.closest('.scroll'))
        .concat([...document.querySelectorAll('#evidence tbody button')].slice(0, 2)).filter(under).map((button) => button.textContent);""")
    assert sized.all(".note"), "while it is there"
    assert covered == []
    sized.click("#view-bench", "Clear all")


def test_no_values_are_shown_without_a_drive(page):
    page.go("bench")
    page.for_drives(1)
    settle(page, lambda: "V" in page.text("#supply-now"))
    page.for_drives()
    try:
        page.drawn()
        numbers = page.run("return [...document.querySelectorAll('.shaft-panel dd:not(.unit)')].map((one) => one.textContent)")
        assert set(numbers) == {"–"}
        for says in ("#supply-now", "#load-now"):
            assert page.text(says) == "No drive is chosen."
        assert page.one('[aria-label="supply, V"]').get_attribute("value") == ""
        assert page.one('[data-key="J_g_cm2"]').get_attribute("value") == ""
        page.one("#view-bench .dial").send_keys("\ue012")  # left arrow
        settle(page, lambda: "choose a drive first" in [note.text for note in page.all(".note")])
    finally:
        page.for_drives(1)
    settle(page, lambda: page.one('[aria-label="supply, V"]').get_attribute("value") != "")


def test_jog_moves_the_chosen_drives_as_a_host_would(page):
    page.go("bench")
    page.for_drives(2)
    angle = lambda: page.reported(2)["signals"]["angle_deg"]
    start = angle()
    page.click("#view-bench", "run: switch on (0x88)")
    page.fill('[aria-label="jog angle, °"]', 30)
    page.fill('[aria-label="jog max speed, °/s"]', 300)
    page.click("#view-bench", "More by angle")
    settle(page, lambda: abs(angle() - start - 30) < 2)
    page.click("#view-bench", "Less by angle")
    settle(page, lambda: abs(angle() - start) < 2)
    page.click("#view-bench", "switch off (0x80)")
    settle(page, lambda: "off: sent" in " ".join(note.text for note in page.all(".note")))
    page.fill('[aria-label="jog angle, °"]', "")
    page.click("#view-bench", "Go to angle")
    settle(page, lambda: any("jog angle" in note.text for note in page.all(".note")))
    page.fill('[aria-label="jog angle, °"]', 90)
    page.for_drives(1)
