"""Makes the pictures of the dashboard in README.md and docs/: python3 pictures.py LK-EMU LK-EMU-BODY

Needs python3-pil with WebP, and a font with Chinese characters (fonts-wqy-microhei). Also writes the structure of each
documented page: test_pictures.py fails when a page no longer has it."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
PICTURES = ROOT / "docs" / "pictures"
STRUCTURES = PICTURES / "structures.json"
sys.path[:0] = [str(ROOT / "python"), str(ROOT / "python" / "examples")]

import page_pictures  # noqa: E402
import robot_pictures  # noqa: E402


def campaign_picture(program):
    with tempfile.TemporaryDirectory() as folder:
        html = pathlib.Path(folder) / "night.html"
        subprocess.run([program, "campaign", "every_fault", "-o", f"{folder}/night.db", "--html", str(html), "--quiet"], check=True,
                       env={**os.environ, "PYTHONPATH": str(ROOT / "python")}, stdout=subprocess.DEVNULL)  # fmt: skip
        return page_pictures.report(html)


def structures(program):
    robot = page_pictures.Robot(program)
    try:
        return robot.structures()
    finally:
        robot.close()


def main():
    program, body_program = sys.argv[1:]
    for name, picture in page_pictures.pages(program):
        picture.save(PICTURES / f"{name}.png", optimize=True)
        print(name, flush=True)
    campaign_picture(program).save(PICTURES / "campaign.png", optimize=True)
    print("campaign", flush=True)
    robot_pictures.write(body_program, PICTURES)
    STRUCTURES.write_text(json.dumps(structures(program), indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
