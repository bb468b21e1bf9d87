"""Tests the pytest plugin by running pytest in pytest."""

import pytest

from lkemu.pytest_plugin import seen_from


@pytest.fixture
def run(pytester, fake):
    """Runs the text of a test file; returns pytest's output and counts."""
    pytester.makeconftest('pytest_plugins = ["lkemu.pytest_plugin"]')
    pytester.makeini("[pytest]\nlkemu_bus = vcan0\n")

    def run_text(text, *options):
        pytester.makepyfile("import pytest\nimport lkemu as package\n" + text)
        return pytester.runpytest_subprocess("-p", "no:cacheprovider", f"--lkemu-program={fake}", *options)

    return run_text


def test_fixtures_give_a_running_emulator(run):
    result = run(
        """
def test_all(lkemu, drives, clock):
    assert drives[4].id == 4 and clock.mode == "realtime" and lkemu.bus == "vcan0"
"""
    )
    result.assert_outcomes(passed=1)


def test_nearest_marker_overrides_other_markers_and_the_ini_file(run):
    result = run(
        """
pytestmark = pytest.mark.lkemu(ids="1-2", clock="stepped")

@pytest.mark.lkemu(ids="7")
def test_one(lkemu):
    assert [drive.id for drive in lkemu.drives] == [7] and lkemu.clock.mode == "stepped"

def test_two(drives):
    assert len(drives) == 2
"""
    )
    result.assert_outcomes(passed=2)


def test_path_in_a_marker_is_relative_to_the_test_file(run):
    result = run(
        """
import os

@pytest.mark.lkemu(motor="./my.toml")
def test_file(lkemu):
    here = os.path.dirname(os.path.abspath(__file__))
    assert os.path.normpath(lkemu.options.motor) == os.path.join(here, "my.toml")

@pytest.mark.lkemu(motor="MG4005-i10")
def test_name(lkemu):
    assert lkemu.options.motor == "MG4005-i10"
"""
    )
    result.assert_outcomes(passed=2)


def test_configuration_is_a_name_unless_the_file_exists(tmp_path):
    assert seen_from(tmp_path, "config", "bench") == "bench"
    (tmp_path / "bench").write_text("")
    assert seen_from(tmp_path, "config", "bench") == str(tmp_path / "bench")
    assert seen_from(tmp_path, "motor", "bench") == "bench"
    assert seen_from(tmp_path, "config", tmp_path / "a.toml") == str(tmp_path / "a.toml")


def test_a_fault_without_effect_fails_the_test(run):
    result = run("def test_it(drives):\n    drives[2].silent(when={'error': 'stall'})\n")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["fault silent on drive 2 never took effect: *"])
    result.stdout.no_fnmatch_line("During handling*")


def test_effective_and_optional_faults_do_not_fail_the_test(run):
    result = run("def test_it(drives):\n    drives[2].jam()\n    drives[1].silent(optional=True)\n")
    result.assert_outcomes(passed=1)


def test_failed_or_skipped_test_keeps_its_message(run):
    result = run(
        """
def test_fails(drives):
    drives[1].silent()
    assert 1 == 2

def test_skips(drives):
    drives[1].silent()
    pytest.skip("no reason")
"""
    )
    result.assert_outcomes(failed=1, skipped=1)
    result.stdout.fnmatch_lines(["*assert 1 == 2"])


def test_failed_test_reports_drives_faults_log_and_recording(run):
    result = run("def test_it(drives, tmp_path):\n    drives[2].jam()\n    assert False\n")
    result.stdout.fnmatch_lines(
        [
            "*- lk-emu: drives -*",
            "realtime, at 0.000000 s",
            "vcan0: 7 queries, 2 wrong length",
            "vcan0:2 running, no errors, angle_deg 12.50, speed_dps 0.00",
            "*- lk-emu: faults -*",
            "fault jam on drive 2 took effect 4 times, first at 0.000000 s on drive 2 (active)",
            "*- lk-emu: output -*",
            "lk-emu ready vcan0",
            "*- lk-emu: log -*",
            "one line of its log",
            "*- lk-emu: recording -*",
            "*test_it0/lkemu/recording",
        ]
    )


def test_junit_xml_contains_the_report(run, pytester):
    run("def test_it(drives):\n    drives[2].silent()\n", "--junitxml=out.xml")
    xml = (pytester.path / "out.xml").read_text()
    assert "fault silent on drive 2 never took effect" in xml


def test_unexpected_end_fails_the_test_with_the_last_log_lines(run):
    result = run(
        """
def test_it(lkemu):
    with pytest.raises(package.Ended):
        lkemu.mark("die")
"""
    )
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*lk-emu ended (status 3)", "*the fake was told so"])


def test_stop_in_the_test_is_not_a_failure(run):
    result = run("def test_it(lkemu):\n    lkemu.drives[1].jam()\n    lkemu.stop()\n")
    result.assert_outcomes(passed=1)


def test_command_line_bus_overrides_ini_file_and_marker(run):
    result = run(
        "@pytest.mark.lkemu(bus='vcan1')\n"
        "def test_it(lkemu):\n    assert lkemu.bus == 'slcan-tcp:29536'\n    assert lkemu.can_args['interface'] == 'slcan'\n",
        "--lkemu-bus=slcan-tcp:29536",
    )
    result.assert_outcomes(passed=1)


def test_recordings_of_passed_tests_are_deleted_unless_kept(run, pytester):
    passes = "def test_it(lkemu):\n    assert lkemu.options.record.endswith('recording')\n"
    for options, kept in (((), 0), (("--lkemu-keep",), 1)):
        run(passes, "--basetemp=base", *options).assert_outcomes(passed=1)
        assert len(list((pytester.path / "base").rglob("recording"))) == kept


def test_recording_can_be_disabled(run):
    result = run("@pytest.mark.lkemu(record=False)\ndef test_it(lkemu):\n    assert lkemu.options.record is None\n")
    result.assert_outcomes(passed=1)


def test_test_can_start_several_emulators(run):
    result = run(
        """
def test_it(lkemu, lkemu_start):
    other = lkemu_start(bus="vcan1", ids=9)
    assert other.drives[9].bus == "vcan1"
    other.drives[9].silent()
"""
    )
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["fault silent on drive 9 never took effect*"])


def test_unittest_classes_can_use_fixtures(run):
    result = run(
        """
import unittest

class TestIt(unittest.TestCase):
    @pytest.fixture(autouse=True)
    def with_drives(self, drives):
        self.drives = drives

    def test_one(self):
        self.drives[1].silent()
"""
    )
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines(["*fault silent on drive 1 never took effect*"])


def test_failed_start_gives_the_reason(run):
    result = run("@pytest.mark.lkemu(arguments=['--refuse'])\ndef test_it(lkemu):\n    pass\n")
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["lk-emu: --refuse: there is no such option"])
    result.stdout.no_fnmatch_line("*Error*traceback*")


@pytest.mark.parametrize(
    "said, sentence",
    [
        ("idz='1-2'", "@pytest.mark.lkemu(idz=…): unknown option; did you mean ids?"),
        ("boot_angle=0", "@pytest.mark.lkemu(boot_angle=…): unknown option; did you mean boot_angle_deg?"),
        ("xyzzy=1", "@pytest.mark.lkemu(xyzzy=…): unknown option; there are: bus, ids, *"),
        ("'1-2'", "@pytest.mark.lkemu('1-2'): takes keywords only, like ids=\"1-4\""),
        ("bus={'vcan0': 1}, ids=2", "ids: bus says it already"),
    ],
)
def test_mistake_in_a_marker_gives_one_sentence(run, said, sentence):
    result = run(f"@pytest.mark.lkemu({said})\ndef test_it(lkemu):\n    pass\n")
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines([sentence.replace("[", "[[]")])
    result.stdout.no_fnmatch_line("*pytest_plugin.py*")
