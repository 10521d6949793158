"""The picture and the animation of README, made by the live page itself in a browser without a window.

A Panda in physics goes round a circle of 0.3 m in 4 s; after 2.2 s the brake of its third joint closes, and
nobody reports it. The rival is the same arm with the same brake, led by damped resolved rates with feedback.
Needs MuJoCo and Chromium (apt install chromium, or FTQP_CHROMIUM=/path/to/it).

    python docs/making/live_pictures.py            docs/pictures/arm-loses-a-joint.png and .gif
    python docs/making/live_pictures.py --still    the picture only
"""

import argparse
import os
import shutil
import sys
from pathlib import Path
from time import sleep
from typing import Any

from PIL import Image, ImageDraw, ImageFont
from playwright.sync_api import sync_playwright

from ftqp.app.view.live_source import arms_of, stage_of
from ftqp.sim.session.frame import Frame
from ftqp.sim.session.live_session import Session
from ftqp.sim.session.session_arms import Choice
from ftqp.sim.session.session_commands import Break, Command
from ftqp.viz.live.live_page import Page
from ftqp.viz.live.stage import Stage

FOLDER = Path(__file__).parents[1] / "pictures"
SCENARIO = Choice(scenario="panda-unannounced", overrides=("faults=[]",))
JOINT, LOCK, END, STILL = "panda_joint3", 2.2, 4.4, 2.96
"""Which joint locks, when, when the animation ends, and when the picture is taken [s]."""
STEP = 0.04
"""Simulated time between two pictures [s] ..."""
SLOWER = 2.0
"""... which the animation shows so many times as slowly."""
WINDOW, SCENE = (1240, 720), (560, 400)
"""Sizes of the picture and of the animation [px]."""
FIELD = 0.68
"""Angle that the animation sees, top to bottom [rad]."""
COLOURS = 200
"""Colours of the animation."""
LARGEST = 3_000_000
"""What an animation in README may weigh [bytes]."""
ARGUMENTS = (
    "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist", "--disable-dev-shm-usage",
)  # fmt: skip


class Story:
    """A source whose time goes on only when it is asked to."""

    def __init__(self) -> None:
        self._session = Session(lambda choice: arms_of(choice, faults=False), SCENARIO)

    def put(self, command: Command) -> None:
        self._session.put(command)

    def frame(self) -> Frame:
        return self._session.frame

    def go_on(self) -> float:
        """One step further; the time [s]."""
        t = self._session.frame.t
        if t < LOCK <= t + STEP:
            self.put(Break(JOINT))
        self._session.advance(STEP)
        return self._session.frame.t

    def stage(self) -> Stage:
        return stage_of(self._session)


def main() -> int:
    """Make the pictures."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--still", action="store_true", help="only the picture")
    parser.add_argument("--out", type=Path, default=FOLDER, help="where the files go")
    options = parser.parse_args()
    program = os.environ.get("FTQP_CHROMIUM") or shutil.which("chromium")
    if program is None:
        print("needs Chromium: apt install chromium, or FTQP_CHROMIUM=/path/to/it", file=sys.stderr)
        return 2
    options.out.mkdir(parents=True, exist_ok=True)
    story = Story()
    with Page(story, port=0) as page, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(ARGUMENTS))
        tab = browser.new_page(viewport={"width": WINDOW[0], "height": WINDOW[1]})
        tab.set_default_timeout(120_000.0)
        tab.goto(page.url)
        tab.wait_for_selector("#ftqp-status")
        tab.locator(".mantine-Notification-closeButton").first.click()
        pictures = film(story, page, tab, options.out, still=options.still)
        browser.close()
    if not options.still:
        save(pictures, options.out / "arm-loses-a-joint.gif")
    return 0


def film(story: Story, page: Page, tab: Any, out: Path, *, still: bool) -> list[Image.Image]:
    """Let the arm go to the end of the story; its pictures."""
    (client,) = page.clients()
    pictures = []
    t = 0.0
    while t < (STILL if still else END):
        before, t = t, story.go_on()
        page.refresh()
        if before < STILL <= t:
            sleep(1.0)
            page.refresh()  # the plots, too
            sleep(3.0)
            tab.screenshot(path=out / "arm-loses-a-joint.png", timeout=120_000.0)
        if not still:
            seen = client.get_render(
                SCENE[1],
                SCENE[0],
                wxyz=client.camera.wxyz,
                position=client.camera.position,
                fov=FIELD,
                transport_format="png",
                timeout=120.0,
            )
            pictures.append(titled(Image.fromarray(seen), story.frame()))
    return pictures


def titled(seen: Image.Image, frame: Frame) -> Image.Image:
    """A picture on white, with the time and both errors."""
    picture = Image.new("RGB", seen.size, "white")
    picture.paste(seen, mask=seen.getchannel("A") if seen.mode == "RGBA" else None)
    pen, font = ImageDraw.Draw(picture), ImageFont.load_default(17)
    locked = bool(frame.truth.any())
    said = f"   {JOINT} brakes, not reported" if locked else ""
    lines = [(f"{frame.t:.2f} s{said}", "#222222")]
    if locked and frame.rival is not None:
        found = "detected by itself" if frame.belief.any() else "not reported"
        lines.append((f"ftqp, {found}: {1e3 * frame.position_error:.1f} mm off", "#2e70b8"))
        beside = f"damped resolved rates, not reported: {1e3 * frame.rival.error:.1f} mm off"
        lines.append((beside, "#783c82"))
    for row, (words, colour) in enumerate(lines):
        pen.text((14, SCENE[1] - 82 + 23 * row), words, fill=colour, font=font)
    return picture


def save(pictures: list[Image.Image], file: Path) -> None:
    """An animation that repeats for ever, in colours of its beginning, its middle and its end."""
    some = pictures[:: len(pictures) // 3]
    together = Image.new("RGB", (some[0].width, some[0].height * len(some)))
    for k, picture in enumerate(some):
        together.paste(picture, (0, k * picture.height))
    palette = together.quantize(COLOURS)
    few = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    shown = round(1e3 * SLOWER * STEP)
    few[0].save(file, save_all=True, append_images=few[1:], duration=shown, loop=0, optimize=True)
    size = file.stat().st_size
    print(f"{file.name}: {len(few)} pictures, {size / 1e6:.2f} MB")
    if size > LARGEST:
        raise SystemExit(f"{file} has {size} bytes, more than {LARGEST}; take fewer colours or pictures")


if __name__ == "__main__":
    sys.exit(main())
