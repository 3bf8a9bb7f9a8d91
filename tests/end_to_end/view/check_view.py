"""The live view of a running session, looked at with a real browser.

    check_view.py --programs build/release/bin [--pictures FOLDER] NAME

NAME is one of the functions below that begin with what is to be true. Nothing here asserts a time: what is to be true after
a while is waited for, and how often a browser without a graphics card draws is its own business.
"""

import argparse
import base64
import csv
import json
import math
import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

PATIENCE_S = 60
AXE = pathlib.Path(__file__).parents[3] / "build/page-packages/node_modules/axe-core/axe.min.js"


def wait_for(what, look):
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        seen = look()
        if seen:
            return seen
        time.sleep(0.05)
    raise AssertionError(f"waited {PATIENCE_S} s in vain: {what}")


class Session:
    """A slave, a master and its view, all of one folder."""

    def __init__(self, programs, seconds=600, touched=("--scene", "block-gear")):
        self.folder = tempfile.TemporaryDirectory(prefix="farfeel-view-")
        self.out = pathlib.Path(self.folder.name)
        self.environment = dict(os.environ, XDG_RUNTIME_DIR=self.folder.name)
        self.programs = pathlib.Path(programs)
        ready, told = os.pipe()
        arguments = ["--listen", "127.0.0.1:0", *touched, "--ready-fd", str(told)]
        if os.geteuid() == 0:
            arguments += ["--user", "root"]
        self.slave = self.start("farfeel-slave", arguments, pass_fds=[told])
        os.close(told)
        with os.fdopen(ready) as pipe:
            port = pipe.readline().split()[1]
        self.master = self.start("farfeel-master", [
            "--connect", f"127.0.0.1:{port}", "--device", "simulated", "--seconds", str(seconds), "--out",
            str(self.out / "out"), "--progress", "none", "--start-view"], stdout=subprocess.PIPE)
        self.address = None
        for line in self.master.stdout:
            if line.startswith("view: "):
                self.address = line.split()[1]
                break
        assert self.address, (self.out / "farfeel-master.log").read_text()
        self.port = int(self.address.split(":")[2].split("/")[0])
        self.host = f"127.0.0.1:{self.port}"

    def start(self, program, arguments, **more):
        log = open(self.out / f"{program}.log", "w")
        return subprocess.Popen([self.programs / program, *arguments], env=self.environment, stderr=log, text=True, **more)

    def end(self):
        """Ends the master as a person does, and gives the rows of its session.csv."""
        self.master.send_signal(signal.SIGINT)
        self.master.communicate(timeout=PATIENCE_S)
        with open(self.out / "out" / "session.csv") as file:
            return list(csv.DictReader(file))

    def close(self):
        for process in (self.master, self.slave):
            if process.poll() is None:
                process.kill()
            process.wait()
        self.folder.cleanup()


class Browser:
    def __init__(self, address, size="1300,950"):
        options = Options()
        options.binary_location = "/usr/bin/chromium"
        # Nothing but the page is fetched: a browser that looks for its maker's hosts keeps a machine without them busy.
        for argument in ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                         "--disable-background-networking", "--disable-component-update", "--disable-sync",
                         "--disable-quic", "--no-first-run", f"--window-size={size}"]:
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service("/usr/bin/chromedriver"))
        self.driver.get(address)

    def resize(self, width, height=1000):
        """To any size, below a window's own least, too."""
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                    {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})

    def prefer(self, scheme):
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]})

    def keep_picture(self, pictures, name):
        if pictures:
            self.driver.save_screenshot(str(pathlib.Path(pictures) / f"{name}.png"))

    def shares(self, png):
        """Of a picture's pixels: the shares that are clearly red, green and blue."""
        return self.driver.execute_async_script("""
            const done = arguments[1], image = new Image();
            image.onload = () => {
              const canvas = document.createElement("canvas"), counts = [0, 0, 0];
              canvas.width = image.width, canvas.height = image.height;
              const context = canvas.getContext("2d");
              context.drawImage(image, 0, 0);
              const rgba = context.getImageData(0, 0, image.width, image.height).data;
              for (let i = 0; i < rgba.length; i += 4)
                for (let c = 0; c < 3; ++c)
                  if (rgba[i + c] > 60 + Math.max(rgba[i + (c + 1) % 3], rgba[i + (c + 2) % 3])) ++counts[c];
              done(counts.map((count) => count / (image.width * image.height)));
            };
            image.src = "data:image/png;base64," + arguments[0];""", base64.b64encode(png).decode())

    def press(self, key):
        self.driver.find_element("tag name", "body").send_keys(key)

    def violations(self):
        """What axe-core finds that shuts somebody out, in words."""
        self.driver.execute_script(AXE.read_text())
        found = self.driver.execute_async_script("const done = arguments[0]; axe.run().then((r) => done(r.violations))")
        return [f"{v['id']} ({v['impact']}): {v['help']}: {[node['html'][:150] for node in v['nodes'][:4]]}" for v in found]

    def too_wide_px(self):
        return self.driver.execute_script("return document.documentElement.scrollWidth - window.innerWidth")

    def outside_of_their_cards(self):
        """Titles of plots that are drawn beyond their cards, which have room for them."""
        return self.driver.execute_script("""
            return [...document.querySelectorAll(".plot")].filter((card) => {
              const box = card.getBoundingClientRect(), drawn = card.querySelector("canvas").getBoundingClientRect();
              return drawn.left < box.left - 0.5 || drawn.right > box.right + 0.5 || drawn.bottom > box.bottom + 0.5 || drawn.width < 100;
            }).map((card) => card.textContent.slice(0, 40))""")

    def shown(self):
        return self.driver.execute_script("return window.farfeelShown ? window.farfeelShown() : null")

    def text(self, identity):
        return self.driver.execute_script("return document.getElementById(arguments[0]).textContent", identity)

    def has_banner(self):
        return self.driver.execute_script("return !document.getElementById('banner').hidden")

    def complaints(self):
        return [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")
                and "GPU stall" not in entry["message"] and "swiftshader" not in entry["message"].lower()]

    def close(self):
        self.driver.quit()


def length(v):
    return math.sqrt(sum(x * x for x in v))


def arrows_are_the_ticks_forces(session, pictures):
    """By tick number, the forces read off the drawn arrows add up to what that tick's row in session.csv has."""
    browser = Browser(session.address, *([] if pictures else ["640,480"]))  # a processor draws a small one sooner
    try:
        seen = {}

        def look():
            shown = browser.shown()
            if shown and shown["forces"]:
                seen[shown["number"]] = shown
            return len(seen) >= 6

        wait_for("six ticks with arrows", look)
        points = browser.shown()["points"]
        wait_for("charts that move", lambda: browser.shown()["points"] > points + 5)
        browser.keep_picture(pictures, "view")
        assert browser.complaints() == [], browser.complaints()
    finally:
        browser.close()
    rows = session.end()
    for number, shown in seen.items():
        row = rows[number]
        assert abs(float(row["time_s"]) - shown["time"]) < 1e-6, (row["time_s"], shown)
        felt = [float(row[f"contact_force_{axis}_N"]) for axis in "xyz"]
        drawn = [sum(force[axis] for force in shown["forces"]) for axis in range(3)]
        scale = sum(length(force) for force in shown["forces"])
        assert length([a - b for a, b in zip(felt, drawn)]) <= 1e-6 * scale, (number, felt, drawn)


def views_follow_the_motion(session, pictures):
    """From the device, and through the tool: the camera keeps its place beside what it follows."""
    browser = Browser(session.address, size="640,480")
    try:
        wait_for("a touch", lambda: browser.shown() and browser.shown()["forces"])
        for key, follows in (("3", "handle"), ("4", "tool")):
            browser.press(key)
            time.sleep(0.5)  # some pictures
            offsets, places = [], []

            def look():
                shown = browser.shown()
                places.append(shown[follows])
                offsets.append([a - b for a, b in zip(shown["camera"], shown[follows])])
                return length([a - b for a, b in zip(places[-1], places[0])]) > 2e-3

            wait_for("a motion", look)
            apart = max(length([a - b for a, b in zip(offset, offsets[0])]) for offset in offsets)
            moved = length([a - b for a, b in zip(places[-1], places[0])])
            # Through the tool it turns with the tool, a little.
            assert apart < (1e-9 if key == "3" else 0.5 * length(offsets[0])), (key, apart, moved)
            browser.keep_picture(pictures, f"view-{follows}")
        assert browser.complaints() == [], browser.complaints()
    finally:
        browser.close()


def tiles_are_drawn_as_they_come(session, pictures):
    browser = Browser(session.address, size="900,700")
    try:
        drawn = lambda: browser.shown()["tiles"]
        wait_for("tiles", lambda: browser.shown() and drawn()["here"] > 0)
        wait_for("their number", lambda: browser.text("tiles-here") == f"{drawn()['here']} of {drawn()['all']}")
        browser.keep_picture(pictures, "view-tiles")
        assert browser.complaints() == [], browser.complaints()
    finally:
        browser.close()


def scan(bake, folder, colours):
    """A block, baked; if it is to be in colours, green at the back, and red and blue at the front, where the views are from."""
    lines = ["ply", "format ascii 1.0", "element vertex 8", *(f"property float {axis}" for axis in "xyz")]
    lines += [f"property uchar {name}" for name in ("red", "green", "blue") if colours]
    lines += ["element face 6", "property list uchar int vertex_indices", "end_header"]
    for i in range(8):
        x, y, z = i & 1, i >> 1 & 1, i >> 2
        colour = (10, 200, 10) if y else (10, 10, 230) if x else (230, 10, 10)
        lines.append(" ".join(map(str, (0.08 * x, 0.06 * y, 0.04 * z) + (colour if colours else ()))))
    lines += ["4 0 2 3 1", "4 4 5 7 6", "4 0 1 5 4", "4 2 6 7 3", "4 0 4 6 2", "4 1 3 7 5", ""]
    (folder / "scan.ply").write_text("\n".join(lines))
    subprocess.run([bake, folder / "scan.ply", "--unit", "m", "--texture", "64", "-o", folder / "scan.glb"], check=True,
                   stdout=subprocess.DEVNULL)
    return folder / "scan.glb"


def a_scan_is_in_its_colours(programs, pictures):
    """On the page and in the session's picture, as they came over the wire; without colours both are as they were."""
    for colours in (True, False):
        with tempfile.TemporaryDirectory(prefix="farfeel-view-") as folder:
            asset = scan(pathlib.Path(programs) / "farfeel-bake", pathlib.Path(folder), colours)
            session = Session(programs, touched=("--object", asset))
            try:
                browser = Browser(session.address, size="640,480")
                try:
                    wait_for("a picture", browser.shown)
                    browser.press("t")  # the tiles' own colours lie over the scan's
                    time.sleep(0.5)  # until what has come is drawn
                    browser.keep_picture(pictures, f"view-scan-{'coloured' if colours else 'plain'}")
                    page = browser.shares(browser.driver.get_screenshot_as_png())
                    assert browser.complaints() == [], browser.complaints()
                    session.end()
                    picture = browser.shares((session.out / "out" / "scene.png").read_bytes())
                finally:
                    browser.close()
            finally:
                session.close()
        # In the session's picture forces are red, on the page the handle may be green.
        if colours:
            assert min(page) > 0.001 and min(picture) > 0.005, (page, picture)
        else:
            assert page[0] < 1e-4 and max(picture[1:]) < 1e-4, (page, picture)


def nobody_is_shut_out(session, pictures):
    """By axe-core: while it touches, while it is paused, light and dark."""
    browser = Browser(session.address)
    try:
        wait_for("a touch", lambda: browser.shown() and browser.shown()["forces"])
        browser.press("\ue014")  # the arrow to the right: a contact's numbers
        for paused in (False, True):
            for scheme in ("light", "dark"):
                browser.prefer(scheme)
                time.sleep(0.5)  # drawn anew
                assert browser.violations() == [], (scheme, paused, browser.violations())
                browser.keep_picture(pictures, f"view-{scheme}{'-paused' if paused else ''}")
            if not paused:
                browser.press("p")
                wait_for("a banner", browser.has_banner)
    finally:
        browser.close()


def the_reports_plots_lie_in_their_cards(session, pictures):
    """report.html in the same browser: narrow, usual and wide, light and dark; and a zoom that all plots share."""
    time.sleep(4)
    session.end()
    browser = Browser(f"file://{session.out}/out/report.html")
    try:
        plots = browser.driver.execute_script("return document.querySelectorAll('.plot canvas').length")
        assert plots >= 10, plots
        for width in (400, 1200, 2000):
            browser.resize(width)
            wait_for(f"a page of {width} px", lambda: browser.too_wide_px() <= 0 and browser.outside_of_their_cards() == [])
            browser.driver.execute_script("document.getElementById('plots').scrollIntoView()")
            time.sleep(0.5)  # drawn anew
            browser.keep_picture(pictures, f"report-{width}")
        assert browser.violations() == [], ("light", browser.violations())
        # The plots are made anew in the other colours, when the page comes to it.
        browser.driver.execute_script("document.querySelector('.plot').classList.add('light')")
        browser.prefer("dark")
        wait_for("dark plots", lambda: len(browser.driver.find_elements("css selector", ".plot canvas")) == plots and
                 not browser.driver.find_elements("css selector", ".plot.light"))
        assert browser.violations() == [], ("dark", browser.violations())
        browser.keep_picture(pictures, "report-dark")
        browser.resize(1200)
        over = browser.driver.find_elements("css selector", ".plot .u-over")
        shown = lambda n: browser.driver.execute_script("return window.farfeelWindow()[arguments[0]]", n)
        whole = shown(1)
        webdriver.ActionChains(browser.driver).move_to_element_with_offset(over[0], -50, 0).click_and_hold().move_by_offset(
            100, 0).release().perform()
        wait_for("a zoom", lambda: shown(0) > 0 and shown(1) < whole)
        webdriver.ActionChains(browser.driver).double_click(over[1]).perform()
        wait_for("all again", lambda: shown(0) == 0 and shown(1) == whole)
        assert browser.complaints() == [], browser.complaints()
    finally:
        browser.close()


def a_latched_fault_has_a_banner_until_it_is_reset(programs, pictures):
    """A slave in Python answers with a plane, and then says of a deep contact that it is gone: the fault stays until the button."""
    sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "protocol"))
    import check_master
    import support

    with tempfile.TemporaryDirectory(prefix="farfeel-view-") as folder:
        run = support.Run(str(pathlib.Path(programs).resolve()), folder)
        ends = check_master._Ends(run, seconds=600, more=["--start-view"])
        respond, is_over = ends.slave.respond, threading.Event()
        lies = threading.Event()
        nothing = ([], (0.0,) * 6)
        ends.slave.respond = lambda pose: (
            nothing if lies.is_set() and ends.plane.depth_m(pose.p_WT, pose.R_WT) > 1.5e-3 else respond(pose))
        answering = threading.Thread(target=lambda: ends.slave.run(600, is_over.is_set))
        answering.start()
        browser = None
        try:
            address = lambda: [line.split()[1] for line in ends.masters_log().splitlines() if line.startswith("view: ")]
            browser = Browser(wait_for("an address", address)[0])
            wait_for("a touch", lambda: browser.shown() and browser.shown()["forces"])
            lies.set()
            wait_for("a latched fault", lambda: browser.has_banner() and "gone at once" in browser.text("happened"))
            lies.clear()
            assert "then reset" in browser.text("to-do"), browser.text("to-do")
            # Words come as they are told, ticks as they are drawn.
            wait_for("the fault in what is drawn", lambda: browser.shown()["state"] == 4)
            time.sleep(1)
            assert browser.has_banner() and browser.shown()["state"] == 4, f"it stays: {browser.shown()['state']}"
            assert browser.violations() == [], browser.violations()
            browser.keep_picture(pictures, "view-fault")
            browser.press("r")
            wait_for("no banner", lambda: not browser.has_banner())
            assert "the fault is reset" in browser.text("answer").lower(), browser.text("answer")
            wait_for("a touch again", lambda: browser.shown()["state"] == 1)
        finally:
            is_over.set()
            answering.join()
            run.programs.end_all()
            if browser:
                browser.close()


def a_silence_has_a_banner_until_it_ends(session, pictures):
    """A remote that is gone makes the loop fade, and the page says so until contacts come again."""
    browser = Browser(session.address)
    try:
        wait_for("a picture", browser.shown)
        wait_for("fresh contacts", lambda: not browser.has_banner())
        session.slave.send_signal(signal.SIGSTOP)
        wait_for("a banner", browser.has_banner)
        wait_for("words", lambda: "force goes to zero" in browser.text("to-do") or "250 ms" in browser.text("happened"))
        session.slave.send_signal(signal.SIGCONT)
        wait_for("no banner", lambda: not browser.has_banner())
        assert browser.complaints() == [], browser.complaints()
    finally:
        browser.close()


def rows_so_far(session):
    with open(session.out / "out" / "session.csv") as file:
        return list(csv.DictReader(line for line in file if line.endswith("\n")))


def felt(session):
    """The force on the hand and the loop's state, as the last row that is on the disk has them."""
    row = rows_so_far(session)[-1]
    return length([float(row[f"hand_force_{axis}_N"]) for axis in "xyz"]), row["state"]


def ask(session, flag):
    """As from a terminal; what is said, and whether it was done."""
    told = subprocess.run([session.programs / "farfeel-view", "--session", str(session.master.pid), flag],
                          env=session.environment, capture_output=True, text=True, timeout=PATIENCE_S)
    return told.returncode == 0, told.stdout + told.stderr


def a_pause_fades_the_force_and_only_a_grip_brings_it_back(session, pictures):
    """By button, by key and from a terminal: what is shown, what is refused, and what the hand gets meanwhile."""
    browser = Browser(session.address)
    press = lambda identity: browser.driver.execute_script("document.getElementById(arguments[0]).click()", identity)
    state = lambda: browser.shown()["state"]
    try:
        wait_for("a touch", lambda: browser.shown() and browser.shown()["forces"])
        press("recentre")
        wait_for("a refusal", lambda: "pause the session first" in browser.text("answer"))
        press("pause")
        wait_for("a banner", lambda: browser.has_banner() and browser.text("happened").startswith("Paused"))
        assert "take hold of the handle anew" in browser.text("to-do"), browser.text("to-do")
        wait_for("no force", lambda: felt(session) == (0.0, "paused"))
        browser.keep_picture(pictures, "view-paused")
        assert browser.text("pause").startswith("Resume")
        began = [float(rows_so_far(session)[0][f"tool_{axis}_m"]) for axis in "xyz"]
        press("recentre")
        wait_for("the tool at its start", lambda: length([a - b for a, b in zip(browser.shown()["tool"], began)]) < 1e-3)
        assert felt(session)[0] == 0.0
        browser.press("p")
        wait_for("no banner", lambda: not browser.has_banner())  # the simulated hand takes hold by itself
        wait_for("force", lambda: felt(session)[0] > 0.2)
        is_done, words = ask(session, "--resume")
        assert not is_done and "not paused" in words, words
        is_done, words = ask(session, "--recentre")
        assert not is_done and "pause the session first" in words, words
        is_done, words = ask(session, "--pause")
        assert is_done and words.startswith("paused"), words
        wait_for("the same on the page", lambda: state() == 5 and browser.text("pause").startswith("Resume"))
        is_done, words = ask(session, "--resume")
        assert is_done and "take hold" in words, words
        wait_for("it goes on", lambda: state() != 5)
        assert browser.complaints() == [], browser.complaints()
    finally:
        browser.close()


def http(session, path="/", **headers):
    request = urllib.request.Request(f"http://{session.host}{path}", headers=headers)
    with urllib.request.urlopen(request, timeout=10) as answer:
        return answer.status, dict(answer.headers)


def upgrade(session, host, origin):
    """The status of the answer to a WebSocket's first words; None where there is none."""
    with socket.create_connection(("127.0.0.1", session.port), timeout=10) as to:
        lines = ["GET / HTTP/1.1", f"Host: {host}", "Upgrade: websocket", "Connection: Upgrade",
                 f"Sec-WebSocket-Key: {base64.b64encode(os.urandom(16)).decode()}", "Sec-WebSocket-Version: 13",
                 "Sec-WebSocket-Protocol: farfeel-view"]
        lines += [f"Origin: {origin}"] if origin else []
        to.sendall("\r\n".join(lines + ["", ""]).encode())
        try:
            answer = to.recv(4096).decode(errors="replace")
        except (ConnectionResetError, TimeoutError):
            return None
        return int(answer.split()[1]) if answer.startswith("HTTP/") else None


def strangers_are_refused(session, pictures):
    ours = f"http://{session.host}"
    assert upgrade(session, session.host, ours) == 101
    for host, origin in [(session.host, "http://evil.example"), (session.host, None), ("evil.example", "http://evil.example"),
                         (session.host, f"https://{session.host}"), (f"localhost:{session.port}", ours)]:
        assert upgrade(session, host, origin) != 101, (host, origin)
    status, headers = http(session)
    headers = {name.lower(): value for name, value in headers.items()}
    assert status == 200
    policy = headers["content-security-policy"]
    assert f"connect-src 'self' ws://{session.host};" in policy and "default-src 'none'" in policy, policy
    assert "unsafe" not in policy and "blob" not in policy, policy
    try:
        http(session, Host="evil.example")
        raise AssertionError("another name of this machine was served")
    except urllib.error.HTTPError as error:
        assert error.code == 403, error.code
    try:
        http(session, "/../../etc/passwd")
        raise AssertionError("there is no such file")
    except urllib.error.HTTPError as error:
        assert error.code in (403, 404), error.code
    browser = Browser(session.address[:-1] + ("0" if session.address[-1] != "0" else "1"))
    try:
        wait_for("a banner", browser.has_banner)
        wait_for("its words", lambda: "not that of the running view" in browser.text("happened"))
        assert browser.shown() is None
    finally:
        browser.close()


def a_stalled_tab_is_at_the_newest_tick_at_once(session, pictures):
    """After a stall the first ticks that are taken are the two in flight; the next is newer than the stall's end."""
    browser = Browser(session.address)
    try:
        wait_for("a picture", browser.shown)
        numbers = browser.driver.execute_async_script("""
            const done = arguments[arguments.length - 1], before = window.farfeelShown().number, began = performance.now();
            while (performance.now() - began < 5000) {}  // nobody reads meanwhile
            const seen = [];
            const look = () => {
              const shown = window.farfeelShown();
              if (seen[seen.length - 1] !== shown.number) seen.push(shown.number);
              seen.length < 5 ? requestAnimationFrame(look) : done([before, ...seen]);
            };
            requestAnimationFrame(look);""")
        before, seen = numbers[0], [number for number in numbers[1:] if number != numbers[0]]
        # A session of a thousand ticks a second: 5 s are more than 4,000 of them. Two old ones may come first.
        assert any(number > before + 4000 for number in seen[:3]), numbers
        assert browser.complaints() == [], browser.complaints()
    finally:
        browser.close()


def two_tabs_and_a_reload(session, pictures):
    first, second = Browser(session.address), Browser(session.address, size="400,900")
    try:
        for browser in (first, second):
            wait_for("a picture", browser.shown)
        second.resize(400)
        wait_for("some seconds in the charts", lambda: first.shown()["seconds"] > 3)
        at, seconds = second.shown()["number"], first.shown()["seconds"]
        first.driver.refresh()
        wait_for("the reloaded one's ticks", lambda: (first.shown() or {"number": 0})["number"] > at)
        assert first.shown()["seconds"] >= min(seconds, 29), "what was before the reload is in the charts"
        wait_for("the other's go on", lambda: second.shown()["number"] > at)
        second.keep_picture(pictures, "view-narrow")
        for width in (400, 1200, 2000):
            second.resize(width)
            wait_for(f"a page of {width} px", lambda: second.too_wide_px() <= 0 and second.outside_of_their_cards() == [])
        for browser in (first, second):
            assert browser.complaints() == [], browser.complaints()
    finally:
        first.close()
        second.close()


def an_end_is_told(session, pictures):
    """A view that is killed takes nothing with it; a master that is killed takes its view along."""
    browser = Browser(session.address)
    try:
        wait_for("a picture", browser.shown)
        children = subprocess.run(["ps", "-o", "pid=,comm=", "--ppid", str(session.master.pid)], capture_output=True, text=True)
        view = [line.split()[0] for line in children.stdout.splitlines() if line.split()[1] == "farfeel-view"]
        assert len(view) == 1, children.stdout
        os.kill(int(view[0]), signal.SIGKILL)
        wait_for("a banner", lambda: browser.has_banner() and "has ended" in browser.text("happened"))
    finally:
        browser.close()
    assert session.master.poll() is None, "the session ended with its view"
    again = session.start("farfeel-view", ["--session", str(session.master.pid)], stdout=subprocess.PIPE)
    address = again.stdout.readline().split()[1]
    browser = Browser(address)
    try:
        wait_for("a picture", browser.shown)
        session.master.kill()
        wait_for("a banner", lambda: browser.has_banner() and "has ended" in browser.text("happened"))
        again.communicate(timeout=PATIENCE_S)
    finally:
        browser.close()
        if again.poll() is None:
            again.kill()


def main():
    with_session = [
        arrows_are_the_ticks_forces, a_silence_has_a_banner_until_it_ends, a_pause_fades_the_force_and_only_a_grip_brings_it_back,
        views_follow_the_motion, tiles_are_drawn_as_they_come, nobody_is_shut_out, strangers_are_refused,
        a_stalled_tab_is_at_the_newest_tick_at_once, two_tabs_and_a_reload, an_end_is_told, the_reports_plots_lie_in_their_cards]
    checks = {check.__name__: check for check in [*with_session, a_latched_fault_has_a_banner_until_it_is_reset, a_scan_is_in_its_colours]}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", required=True)
    parser.add_argument("--pictures")
    parser.add_argument("check", choices=[*checks, "all"])
    arguments = parser.parse_args()
    for check in checks.values() if arguments.check == "all" else [checks[arguments.check]]:
        if arguments.check == "all":
            print(check.__name__, flush=True)
        if check not in with_session:
            check(arguments.programs, arguments.pictures)
            continue
        session = Session(arguments.programs)
        try:
            check(session, arguments.pictures)
        finally:
            session.close()


if __name__ == "__main__":
    sys.exit(main())
