"""The pictures of robots in README.md and docs/: python3 robot_pictures.py LK-EMU-BODY [DIRECTORY]

Hosts of python/examples move them with a stepped clock, which stands while a picture is taken: so each of them shows one instant,
however long the browser takes to draw it. Wants python3-pil, with WebP."""

import io
import os
import pathlib
import sys

from dashboard import Page, free_ports
from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[2]
PICTURES = ROOT / "docs" / "pictures"
sys.path[:0] = [str(ROOT / "python"), str(ROOT / "python" / "examples")]

import lkemu  # noqa: E402
import quadruped  # noqa: E402
import quadruped_walk  # noqa: E402
from lk_joints import Joints, Rounds, bus_and_time  # noqa: E402

SIZE = (1320, 760)
SCALE = 0.8  # of the picture
HEADER_PX = 88  # of the page, which is left out: its clock is a stepped one
FRAME_S = 0.08
WALK_S = float(os.environ.get('WALK', '4.5'))
NEARER = "++"  # keys of the panel
MOST_BYTES = 1_500_000


def last_instant(page):
    """That the robot's panel has drawn."""
    return page.driver.execute_async_script(
        "const done = arguments[0]; import('/robot.js').then(({inspectRobot}) => done(inspectRobot().time_s ?? -1))")


class Camera:
    """Takes a picture of the page whenever `frame_s` of simulated time have gone by."""

    def __init__(self, page, now, sleep, frame_s):
        self.page, self.now, self.plain_sleep, self.frame_s = page, now, sleep, frame_s
        self.frames, self.next_s = [], None

    def begin(self):
        self.next_s = self.now()

    def end(self):
        self.next_s = None

    def sleep(self, seconds):
        self.plain_sleep(seconds)
        if self.next_s is not None and self.now() >= self.next_s:
            self.next_s += self.frame_s
            self.frames.append(self.picture())

    def picture(self):
        self.page.until(lambda: last_instant(self.page) > self.now() - 0.02)
        self.page.drawn()
        picture = Image.open(io.BytesIO(self.page.driver.get_screenshot_as_png())).convert("RGB")
        picture = picture.crop((0, HEADER_PX, *SIZE))
        return picture.resize([round(SCALE * length) for length in picture.size], Image.Resampling.LANCZOS)


class Stage:
    """A robot with its host's bus and time, and its dashboard."""

    def __init__(self, program, robot):
        (http,) = free_ports(1)
        (port,) = free_ports(1)
        self.emulator = lkemu.Emulator(bus=f"slcan-tcp:{port}", config=robot, program=program, clock="stepped",
                                       arguments=["--http", f"127.0.0.1:{http}", "--http-write"]).start()
        os.environ.update(LKEMU_BUS=self.emulator.buses[0], LKEMU_CONTROL=self.emulator.control)
        self.bus, self.now, self.sleep = bus_and_time()
        self.page = Page(http, SIZE, "?lang=en", before="localStorage.setItem('lk-emu-theme', 'dark')")
        self.page.until(lambda: self.page.all("#robot .robot-replay"))
        self.page.one("#robot canvas").send_keys(NEARER)
        self.page.run("document.activeElement.blur()")

    def close(self):
        self.page.close()
        self.bus.shutdown()
        self.emulator.stop()


def walking_dog(program):
    """It stands up from where it lies, and walks."""
    stage = Stage(program, "quadruped_on_the_ground")
    camera = Camera(stage.page, stage.now, stage.sleep, FRAME_S)
    try:
        dog = Joints(stage.bus, quadruped.joints(), stage.now, camera.sleep)
        camera.sleep(quadruped_walk.BOOT_S)
        dog.start()
        camera.begin()
        quadruped.stand_up(dog, Rounds(quadruped.PERIOD_S, stage.now, camera.sleep))
        quadruped_walk.walk(dog, Rounds(quadruped.PERIOD_S, stage.now, camera.sleep), WALK_S, 0.3)
        return camera.frames
    finally:
        stage.close()


def main():
    program = sys.argv[1]
    directory = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else PICTURES
    directory.mkdir(parents=True, exist_ok=True)
    first, *others = walking_dog(program)
    file = directory / "robot.webp"
    first.save(file, save_all=True, append_images=others, duration=round(1000 * FRAME_S), loop=0, quality=60, method=6)
    print(f"{file}: {len(others) + 1} pictures, {file.stat().st_size} bytes")


if __name__ == "__main__":
    main()
