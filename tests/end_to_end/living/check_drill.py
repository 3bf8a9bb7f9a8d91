#!/usr/bin/env python3
"""A living scene that is edited through everything that goes wrong: loss and reordering, a link that is cut, watchers that
come late, a slave that is killed amid an edit and started anew from its disk.

Afterwards, when all is quiet: whoever watches, from the beginning, late, or past the bad link, sees the same objects in the
same places and the same version; nothing that was told as durable is lost; each edit that was answered has a version of
its own, so none was made twice; what the slave gives as files is, to the last byte, what one gives that was started anew.

  check_drill.py --programs build/release/bin --seeds 1-100
"""

import argparse
import filecmp
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time

_LINK = "rtt=40ms jitter=6ms loss=5%,burst=2 reorder=2%"
_EDITS, _KILLS = 14, 2
_SCENE = """
editable = true
stamp_room_m = 0.002
[tool]
model = "probe"
[[object]]
name = "block"
model = "block"
[[object]]
name = "visitor"
model = "block"
present = false
[exploration]
tool_point_m = [0.0, 0.0, -0.003]
tool_normal = [0.0, 0.0, -1.0]
region_low_m = [-0.010, -0.008, 0.020]
region_high_m = [0.012, 0.008, 0.020]
approach = [0.0, 0.0, -1.0]
press_force_N = 2.0
stroke_speed_m_per_s = 0.05
"""
_PATIENCE_S = 60


def _expect(true, *what):
    if not true:
        raise AssertionError(" ".join(str(w) for w in what))


class _Process:
    """A program, whose output goes to a file."""
    all = []

    def __init__(self, folder, name, arguments):
        self.path = f"{folder}/{name}.log"
        with open(self.path, "a", encoding="utf-8") as said:
            self.process = subprocess.Popen(arguments, stdout=said, stderr=subprocess.STDOUT)
        _Process.all.append(self.process)

    def said(self):
        with open(self.path, encoding="utf-8") as file:
            return file.read()

    def wait_for(self, pattern, times=1):
        end = time.monotonic() + _PATIENCE_S
        while len(re.findall(pattern, self.said())) < times:
            _expect(self.process.poll() is None and time.monotonic() < end, "did not say", pattern, self.said()[-2000:])
            time.sleep(0.02)
        return re.findall(pattern, self.said())[-1]

    def end(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        self.process.wait(timeout=_PATIENCE_S)
        return self.said()


class _World:
    """The slave with its disk, the link before it, and whoever comes over it."""

    def __init__(self, programs, folder, seed):
        self.programs, self.folder, self.starts, self.port = programs, folder, 0, 0
        with open(f"{folder}/drill.toml", "w", encoding="utf-8") as file:
            file.write(_SCENE)
        self.start_slave()
        self.seed, self.links = seed, []
        self.start_link()

    def start_slave(self):
        self.starts += 1
        self.slave = _Process(self.folder, f"slave{self.starts}", [
            f"{self.programs}/farfeel-slave", "--scene", f"{self.folder}/drill.toml", "--state", f"{self.folder}/state",
            "--listen", f"127.0.0.1:{self.port}"])
        self.port = int(self.slave.wait_for(r"serving .* on 127\.0\.0\.1:(\d+)"))

    def start_link(self):
        """One for a few of those who come: a link has room for so many sockets."""
        self.links.append(_Process(self.folder, f"link{len(self.links)}", [
            f"{self.programs}/farfeel-link", "--listen", "127.0.0.1:0", "--slave", f"127.0.0.1:{self.port}", "--link", _LINK,
            "--seed", str(self.seed + 1000 * len(self.links))]))
        self.links[-1].wait_for(r"127\.0\.0\.1:\d+")

    def over_link(self):
        return ["--connect", "127.0.0.1:" + re.search(r"127\.0\.0\.1:(\d+)", self.links[-1].said()).group(1)]

    def past_link(self):
        return ["--connect", f"127.0.0.1:{self.port}"]

    def watch(self, name, to, seconds=0):
        wait = ["--seconds", str(seconds)] if seconds else []
        return _Process(self.folder, name, [f"{self.programs}/farfeel", "scene", "watch", "--json", *wait, *to, "--timeout", "20"])

    def seen(self, name, to, seconds):
        """The scene's objects and version, as one sees who watches for so long."""
        watcher = self.watch(name, to, seconds)
        watcher.process.wait(timeout=_PATIENCE_S)
        return _seen(watcher.said())

    def edit(self, words):
        return subprocess.Popen([f"{self.programs}/farfeel", "scene", "edit", *words, *self.over_link(), "--timeout", "20"],
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def save(self, name):
        done = subprocess.run([f"{self.programs}/farfeel", "scene", "save", *self.past_link(), "-o", f"{self.folder}/{name}"],
                              capture_output=True, text=True, timeout=_PATIENCE_S, check=False)
        _expect(done.returncode == 0, done.stdout, done.stderr)
        return f"{self.folder}/{name}"


def _seen(told):
    """The newest of each object, and the scene's version."""
    rows = [json.loads(line) for line in told.splitlines() if line.startswith("{")]
    return ({row["object"]: (row["present"], row["p_WO_m"]) for row in rows if "object" in row},
            max([row["version"] for row in rows if "version" in row], default=0))


def _some_edit(random_, is_there):
    """Most can be made; of the visitor, that depends on whether it is there."""
    crest, y = f"{0.006 * random_.randint(-4, 4):.4f}", f"{random_.uniform(-0.025, 0.025):.4f}"
    stamp = ["stamp", "block", "--at", crest, y, "0.02", "--radius", f"{random_.uniform(0.004, 0.012):.4f}", "--depth",
             f"{random_.uniform(0.0001, 0.0004):.5f}"]
    spawn = ["spawn", "visitor", "--at", f"{random_.uniform(0.1, 0.2):.4f}", "0", "0.001"]
    move = ["move", "visitor", "--at", f"{random_.uniform(0.1, 0.3):.4f}", y, "0.001", "--takes", "0.2"]
    remove = ["remove", "visitor"]
    legal = [move, move, remove] if is_there else [spawn, spawn]
    wanted = random_.random()
    if wanted < 0.1:
        return random_.choice([spawn, move, remove])
    if wanted < 0.2:
        return ["revert", random_.choice(["block", "visitor"])]
    return stamp if wanted < 0.6 else random_.choice(legal)


def _same_files(a, b):
    names = sorted(os.listdir(a))
    _expect(names == sorted(os.listdir(b)), names, os.listdir(b))
    return filecmp.cmpfiles(a, b, names, shallow=False)[0] == names


def drill(programs, seed):
    random_ = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        world = _World(programs, folder, seed)
        early = world.watch("early", world.over_link())
        hand = _Process(folder, "hand", [f"{programs}/farfeel-master", *world.over_link(), "--device", "simulated", "--seconds",
                                         "600", "--out", f"{folder}/run", "--progress", "none"])
        hand.wait_for("received: ")
        kills = sorted(random_.sample(range(2, _EDITS), _KILLS))
        answers, durable, lost, middle, is_there = {}, set(), set(), None, False
        for n in range(_EDITS):
            words = _some_edit(random_, is_there)
            world.start_link()
            asks_durable = random_.random() < 0.5
            asked = world.edit([*words, *(["--durable"] if asks_durable else [])])
            if n in kills:
                time.sleep(random_.uniform(0.0, 0.25))
                world.slave.end(signal.SIGKILL)
                world.start_slave()
                kept = re.search(r"as it was left, in version (\d+)", world.slave.said())
                kept = int(kept.group(1)) if kept else 0
                _expect(max(durable, default=0) <= kept, "durable and lost", durable, kept)
                lost |= {version for version in answers if version > kept}
                answers = {version: what for version, what in answers.items() if version <= kept}
            if n == _EDITS // 2:
                middle = world.watch("middle", world.over_link())
            said, why = asked.communicate(timeout=_PATIENCE_S)
            version = re.search(r"\(version (\d+) of the scene(, durable)?\)", said)
            if version is None:
                _expect("there already" in why or "is not there" in why or "cannot be stamped" in why, words, said, why)
                continue
            _expect(int(version.group(1)) not in answers, "two edits with one version", version.group(1), words, answers)
            answers[int(version.group(1))] = words
            is_there = (words[0] in ("spawn", "move")) if words[1] == "visitor" else is_there
            if version.group(2):
                durable.add(int(version.group(1)))
        time.sleep(2.5)
        past = world.seen("past", world.past_link(), 2)
        world.start_link()
        late = world.seen("late", world.over_link(), 4)
        _expect(past[1] == max(answers, default=0), "the scene's version is not its newest edit's", past, sorted(answers))
        _expect(late == past, "who came late sees otherwise:", late, past)
        for name, watcher in (("early", early), ("middle", middle)):
            _expect(_seen(watcher.end(signal.SIGINT)) == past, name, "sees otherwise:", _seen(watcher.said()), past)
        _expect(hand.process.poll() is None, "the hand's session ended:", hand.said()[-2000:])
        before = world.save("before")
        world.slave.end(signal.SIGTERM)
        world.start_slave()
        _expect(_same_files(before, world.save("after")), "a slave started anew has another scene")
        hand.end(signal.SIGINT)
        told = hand.said()
        _expect("another scene" not in told, told[-2000:])
        world.slave.end()
        for link in world.links:
            link.end()
        _expect(len(answers) >= 5, "few edits were made", answers)
        print(f"seed {seed}: {len(answers)} edits hold, {len(durable)} durable, {len(lost)} lost that were not; version {past[1]}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--programs", required=True)
    parser.add_argument("--seeds", default="1", help="one, several (1,4) or from one to another (1-100)")
    arguments = parser.parse_args()
    try:
        for part in arguments.seeds.split(","):
            first, _, last = part.partition("-")
            for each in range(int(first), int(last or first) + 1):
                drill(arguments.programs, each)
    finally:
        for process in _Process.all:
            process.kill()
    sys.exit(0)
