"""Pictures of robots. Hosts of python/examples move them with a stepped clock, which is paused while a picture is taken.
Each picture therefore shows one instant, at any drawing speed. GIF and APNG would be three times as large as WebP."""

import contextlib
import io
import os

import quadruped
import quadruped_walk
from bench import free_ports
from dashboard import Browser, Page
from lk_joints import JointError, Joints, Rounds, bus_and_time
from page_pictures import wait_for_status
from PIL import Image

import lkemu

SIZE = (1440, 790)
HEADER_PX = 88  # header with the clock, cropped
SCALE = 0.69  # of the moving picture: 990 pixels wide
QUALITY, METHOD = 40, 4
MOST_BYTES = 1_500_000
FRAME_S = 0.08
WALK_S, WALK_M_S = 4.5, 0.3
SAG_S = 0.2  # until the voltage of the dead knee is gone


def last_instant(page):
    """Returns the instant that the robot's panel has drawn, in seconds."""
    return page.driver.execute_async_script(
        "const done = arguments[0]; import('/robot.js').then(({inspectRobot}) => done(inspectRobot().time_s ?? -1))")


class Stage:
    """A robot with its host's bus and clock, and its dashboard. After `film`, `sleep` takes a frame every FRAME_S."""

    def __init__(self, program, robot):
        http, port = free_ports(2)
        self.emulator = lkemu.Emulator(bus=f"slcan-tcp:{port}", config=robot, program=program, clock="stepped",
                                       arguments=["--http", f"127.0.0.1:{http}", "--http-write"]).start()
        os.environ.update(LKEMU_BUS=self.emulator.buses[0], LKEMU_CONTROL=self.emulator.control)
        self.bus, self.now, self.plain_sleep = bus_and_time()
        self.browser = Browser()
        self.page = Page(self.browser, http, SIZE, "?lang=en", before="localStorage.setItem('lk-emu-theme', 'dark')")
        self.page.until(lambda: self.page.all("#robot .robot-replay"))
        self.frames, self.next_s = [], None

    def film(self):
        self.next_s = self.now()

    def sleep(self, seconds):
        self.plain_sleep(seconds)
        if self.next_s is not None and self.now() >= self.next_s:
            self.next_s += FRAME_S
            picture = self.picture()
            self.frames.append(picture.resize([round(SCALE * length) for length in picture.size], Image.Resampling.LANCZOS))

    def picture(self):
        """Returns a picture of this instant without the page's header."""
        self.page.until(lambda: last_instant(self.page) > self.now() - 0.02)
        wait_for_status(self.page, self.now())
        self.page.drawn()
        return Image.open(io.BytesIO(self.page.driver.get_screenshot_as_png())).convert("RGB").crop((0, HEADER_PX, *SIZE))

    def panel(self):
        box = self.page.run("return document.querySelector('#robot').getBoundingClientRect().toJSON()")
        left, top = box["x"], box["y"] - HEADER_PX
        return self.picture().crop([round(edge) for edge in (left, top, left + box["width"], top + box["height"])])

    def joints(self, joints):
        """Returns the robot's joints once its drives have booted."""
        self.sleep(quadruped_walk.BOOT_S)
        return Joints(self.bus, joints, self.now, self.sleep)

    def rounds(self):
        return Rounds(quadruped.PERIOD_S, self.now, self.sleep)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.browser.close()
        self.bus.shutdown()
        self.emulator.stop()


def walking_dog(program):
    """Records the dog while it stands up and walks."""
    with Stage(program, "quadruped_on_the_ground") as stage:
        dog = stage.joints(quadruped.joints())
        dog.start()
        stage.film()
        quadruped.stand_up(dog, stage.rounds())
        quadruped_walk.walk(dog, stage.rounds(), WALK_S, WALK_M_S)
        return stage.frames


def dog_on_three_legs(program):
    """One knee drive loses power."""
    with Stage(program, "quadruped_on_the_ground") as stage:
        dog = stage.joints(quadruped.joints())
        dog.start()
        quadruped.stand_up(dog, stage.rounds())
        stage.page.click("#robot", "errors")
        stage.emulator.drives[6].power.off()
        with contextlib.suppress(JointError):  # the host gives up
            quadruped_walk.stand(dog, stage.rounds(), 1)
        stage.sleep(SAG_S)
        return stage.panel()


def write(program, directory):
    dog_on_three_legs(program).save(directory / "robot_errors.webp", quality=80)
    first, *others = walking_dog(program)
    film = directory / "robot.webp"
    first.save(film, save_all=True, append_images=others, duration=round(1000 * FRAME_S), loop=0, quality=QUALITY, method=METHOD)
    size = film.stat().st_size
    print(f"{film}: {1 + len(others)} pictures, {size} bytes")
    assert size < MOST_BYTES, f"{film} is larger than {MOST_BYTES} bytes"
