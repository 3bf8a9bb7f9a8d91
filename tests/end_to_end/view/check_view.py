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
import time
import urllib.error
import urllib.request

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

PATIENCE_S = 60


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

    def __init__(self, programs, seconds=600):
        self.folder = tempfile.TemporaryDirectory(prefix="farfeel-view-")
        self.out = pathlib.Path(self.folder.name)
        self.environment = dict(os.environ, XDG_RUNTIME_DIR=self.folder.name)
        self.programs = pathlib.Path(programs)
        ready, told = os.pipe()
        arguments = ["--listen", "127.0.0.1:0", "--scene", "block-gear", "--ready-fd", str(told)]
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
        if pictures:
            browser.driver.save_screenshot(str(pathlib.Path(pictures) / "view.png"))
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


def a_fault_has_a_banner_until_it_is_reset(session, pictures):
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
        at = second.shown()["number"]
        first.driver.refresh()
        wait_for("the reloaded one's ticks", lambda: (first.shown() or {"number": 0})["number"] > at)
        wait_for("the other's go on", lambda: second.shown()["number"] > at)
        wide = second.driver.execute_script("return document.documentElement.scrollWidth - window.innerWidth")
        assert wide <= 0, f"at 400 px the page is {wide} px too wide"
        if pictures:
            second.driver.save_screenshot(str(pathlib.Path(pictures) / "view-narrow.png"))
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
    checks = {check.__name__: check for check in [
        arrows_are_the_ticks_forces, a_fault_has_a_banner_until_it_is_reset, strangers_are_refused,
        a_stalled_tab_is_at_the_newest_tick_at_once, two_tabs_and_a_reload, an_end_is_told]}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", required=True)
    parser.add_argument("--pictures")
    parser.add_argument("check", choices=checks)
    arguments = parser.parse_args()
    session = Session(arguments.programs)
    try:
        checks[arguments.check](session, arguments.pictures)
    finally:
        session.close()


if __name__ == "__main__":
    sys.exit(main())
