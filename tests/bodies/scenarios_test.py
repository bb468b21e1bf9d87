#!/usr/bin/env python3
"""Scenarios with a cause on the bus or in a drive and an effect in the body: neither part alone shows the effect.

    scenarios_test.py LK-EMU-BODY SCENARIO

In the scenario "# the cause" marks its cause, and "# in the body" the expectations of its effect. The unchanged
scenario passes. Without the cause the effects are missing, but all earlier expectations hold. With the cause but
without the body (equal drives at equal angles, uncoupled) the effects are missing too. In that case expectations of the
body itself (signal = "body.…") are refused, in one line.
"""

import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from pathlib import Path

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
# Load on the shaft of a single drive in g cm2, about that of a leg or an arm.
ALONE_G_CM2 = 200_000


def blocks(text):
    """Returns the tables of the file, each with the comments before it."""
    return re.split(r"\n(?=(?:#[^\n]*\n)*\[\[)", text)


def start_deg(model):
    """Returns the joint angles of the model's first keyframe."""
    root = ElementTree.parse(CONFIGS / "bodies" / f"{model}.xml").getroot()
    hinges = [joint.get("name") for joint in root.find("worldbody").iter("joint")]
    qpos = [float(word) for word in root.find("keyframe/key").get("qpos").split()]
    return {name: 57.29577951308232 * angle for name, angle in zip(hinges, qpos[len(qpos) - len(hinges) :])}


def without_body(robot_text, gears):
    """Returns the robot's drives at their angles, each with its own load."""
    model = re.search(r'^model = "(\w+)"', robot_text, re.M).group(1)
    angles = start_deg(model)

    def alone(match):
        name = re.search(r'"(\w+)"', match.group(0)).group(1)
        direction = -1 if "direction = -1" in match.group(0) else 1
        rotor_deg = direction * angles[name] * gears[re.findall(r'motor = "([\w-]+)"', robot_text[: match.start()])[-1]]
        return f"boot_angle_deg = {rotor_deg:.3f}\nload = {{ J_g_cm2 = {ALONE_G_CM2} }}"

    robot_text = re.sub(r"^joint = .*$", alone, robot_text, flags=re.M)
    return re.sub(r"^\[body\]\n(?:\w+ = .*\n)*", "", robot_text, flags=re.M)


def outcome(program, text, directory):
    """Runs the scenario; returns whether each expectation passed, by its text."""
    scenario, report = Path(directory) / "scenario.toml", Path(directory) / "report.xml"
    scenario.write_text(text)
    report.unlink(missing_ok=True)
    done = subprocess.run([program, "run", scenario, "--junit", report], capture_output=True, text=True, timeout=300)
    if not report.exists():
        sys.exit(f"no report: {done.stdout}{done.stderr}")
    print(done.stdout)
    results = {}
    for case in ElementTree.parse(report).getroot().iter("testcase"):
        results[case.get("name")] = case.find("failure") is None and case.find("error") is None
    return results


def refusal(program, text, directory):
    """Returns the reason why a scenario is refused."""
    scenario = Path(directory) / "scenario.toml"
    scenario.write_text(text)
    done = subprocess.run([program, "run", scenario], capture_output=True, text=True, timeout=300)
    return f"{done.returncode}: {done.stderr.strip()}"


def is_of_the_body(block):
    return "[[expect]]" in block and re.search(r'^signal = "body\.', block, re.M) is not None


def check_without_body(program, text, directory, effects):
    """Checks that uncoupled drives do not show the effects. `effects`: their texts, by block."""
    problems = []
    all_blocks = blocks(text)
    of_drives = [block for block in all_blocks if not is_of_the_body(block)]
    for block in all_blocks:
        if is_of_the_body(block):
            reason = refusal(program, "\n".join([*of_drives, block]), directory)
            print(f"without the body: {reason}")
            if not re.fullmatch(r"2: lk-emu: \S+: expect\.signal: the robot has no \[body\]", reason):
                problems.append(f"without the body it is not refused but: {reason}")
    results = outcome(program, "\n".join(of_drives), directory)
    for block, effect in effects.items():
        if block in of_drives and passed(results, effect):
            problems.append(f"without the body, too: {effect}")
    return problems


def passed(results, says):
    found = [ok for name, ok in results.items() if says in name]
    if len(found) != 1:
        sys.exit(f'"{says}": {len(found)} results among {list(results)}')
    return found[0]


def main():
    program, path = sys.argv[1], Path(sys.argv[2]).resolve()
    text = path.read_text()
    causes = [block for block in blocks(text) if "# the cause" in block]
    expected = [block for block in blocks(text) if "[[expect]]" in block]
    says = {block: re.search(r'says = "(.*)"', block).group(1) for block in expected}
    effects = [says[block] for block in expected if "# in the body" in block]
    before = [says[block] for block in expected if "# before" in block]
    if not causes or not effects or not before:
        sys.exit(f"{path}: it has no cause, no effect or nothing before")
    name = re.search(r'^robot = "(.*)"', text, re.M).group(1)
    robot = path.parent / name if name.endswith(".toml") else CONFIGS / "buses" / f"{name}.toml"
    gears = {
        motor.stem: int(re.search(r"^gear_ratio = (\d+)", motor.read_text(), re.M).group(1))
        for motor in (CONFIGS / "motors").glob("mg*.toml")
        if "\ngear_ratio" in motor.read_text()
    }
    problems = []
    with tempfile.TemporaryDirectory() as directory:
        bodiless = Path(directory) / "bodiless.toml"
        bodiless.write_text(without_body(robot.read_text(), gears))

        def named(text, robot):
            return re.sub(r'^robot = ".*"', f'robot = "{robot}"', text, flags=re.M)

        results = outcome(program, named(text, robot), directory)
        problems += [f"it does not pass: {name}" for name, ok in results.items() if not ok]
        calm = "\n".join(block for block in blocks(named(text, robot)) if "# the cause" not in block)
        results = outcome(program, calm, directory)
        problems += [f"without the cause, too: {effect}" for effect in effects if passed(results, effect)]
        problems += [f"without the cause, not: {state}" for state in before if not passed(results, state)]
        effects_by_block = {block: says[block] for block in expected if "# in the body" in block}
        problems += check_without_body(program, named(text, bodiless), directory, effects_by_block)
    print("\n".join(problems) or f"{path.name}: neither alone shows it")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
