"""Every command that README and docs tell a reader to type is run, as it stands there, and what it says has the shape that the reader
is led to expect. A case is a set of commands that belong together.

python3 tests/first_hour/check_documents.py --programs build/release/bin --root . every_command_is_played
"""

import json
import os
import pathlib
import re
import shlex
import socket
import subprocess
import sys
import time

from document_commands import documented
from place import PATIENCE_S, Skip, expect, run_cases

# What no test can run, and why.
_NOT_PLAYED = {
    "deploy/test": "it runs this test",
    "sudo ufw allow 47000/udp": "changes the machine's firewall, as root",
    "sudo ufw allow 47200/udp": "changes the machine's firewall, as root",
    "sudo farfeel-slave": "becomes who called sudo, who has to be somebody: confinement_test has that with users of its own",
    "cp deploy/udev/70-farfeel.rules /etc/udev/rules.d/ && udevadm control --reload && udevadm trigger":
        "changes the machine's rules, as root: deploy/hardware-lab does it in a guest",
    "farfeel device identify-limits": "the same command with a name is played",
    "ctest --preset release -L fast": "it runs this test",
    "ctest --preset release -L umockdev": "part of deploy/test",
    "ctest --preset release -R DeviceSession": "part of deploy/test",
    "deploy/hardware-lab [--quick]": "boots another kernel, minutes",
    "deploy/hardware-lab --quick --device NAME": "boots another kernel, minutes",
    "deploy/gpu-check --pack FILE": "is for a machine with a graphics card",
    "deploy/gpu-check --quick": "is for a machine with a graphics card",
    "farfeel bench": "builds farfeel-bench; its commands are looked up in a case of their own",
}
# Measurements take minutes to hours. They are looked up: the command is there, and has the options that the page gives it.
_LOOKED_UP = ("farfeel-bench ", "deploy/measure ")

# What a reader has told the shell before any of the others.
_FIRST_OF_ALL = 'export PATH="$PWD/build/release/bin:$PATH"'

_played = {}


def plays(*commands):
    """Marks a case with the commands that it plays; all of them have to be."""
    def mark(case):
        _played[case.__name__] = commands
        def run(place):
            desk = Desk(place, commands)
            try:
                case(desk)
            finally:
                desk.close()
            missed = set(commands) - desk.typed
            expect(not missed, "not played:", missed)
        return run
    return mark


class Desk:
    """A person with a document: types what it says, in a folder that looks like the source tree."""

    def __init__(self, place, commands):
        self.place, self.commands, self.typed, self.running = place, commands, set(), []
        (place.home / "build" / "release").mkdir(parents=True)
        (place.home / "build" / "release" / "bin").symlink_to(place.programs)
        cache = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.environ.get("HOME", "/nonexistent"), ".cache")
        path = subprocess.run(f'{_FIRST_OF_ALL}; printf %s "$PATH"', shell=True, cwd=place.home, stdout=subprocess.PIPE, text=True).stdout
        self.variables = {"PATH": path, "XDG_CACHE_HOME": cache}  # what is baked stays baked

    def at(self, home):
        """The same desk at another machine: with a home of its own."""
        there = self.place.home / home
        there.mkdir(exist_ok=True)
        return {"HOME": str(there), "XDG_RUNTIME_DIR": str(there)}

    def _line(self, command, put):
        expect(command in self.commands, "not one of this case's commands:", command)
        self.typed.add(command)
        for written, meant in put.items():
            expect(written in command or written == "", f"{command!r} has no {written!r} any more")
            command = command.replace(written, meant) if written else f"{command} {meant}"
        return command

    def type(self, command, *shapes, put={}, status=0, machine={}):
        """Runs it; put: what stands for a placeholder, or with '' at the end. shapes: what the words have to match, each."""
        told = subprocess.run(self._line(command, put), shell=True, cwd=self.place.home, text=True, errors="replace",
                              env=self.place.environment(**self.variables, **machine), stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=PATIENCE_S)
        expect(told.returncode == status, command, "ended with", told.returncode, told.stdout)
        for shape in shapes:
            expect(re.search(shape, told.stdout, re.MULTILINE), f"{command}: no {shape!r} in", told.stdout)
        return told.stdout

    def start(self, command, until, *, put={}, machine={}):
        """Starts it and waits until its words match; they are in a file, which is returned."""
        said = self.place.home / f"said-{len(self.running)}"
        with open(said, "w") as file:
            started = subprocess.Popen(["sh", "-c", "exec " + self._line(command, put)], cwd=self.place.home, stdin=subprocess.DEVNULL,
                                       env=self.place.environment(**self.variables, **machine), stdout=file, stderr=file)
        self.running.append(started)
        self.wait_for(said, until, started)
        return said

    def wait_for(self, said, shape, process=None):
        end = time.monotonic() + PATIENCE_S
        while not re.search(shape, said.read_text(errors="replace"), re.MULTILINE):
            expect(time.monotonic() < end, f"no {shape!r} in", said.read_text())
            expect(process is None or process.poll() is None, f"ended before {shape!r}:", said.read_text())
            time.sleep(0.05)

    def stop(self):
        """Ends what was started last, as Ctrl-C does; its status."""
        last = self.running.pop()
        last.terminate()
        return last.wait(timeout=PATIENCE_S)

    def close(self):
        while self.running:
            last = self.running.pop()
            last.kill()
            last.wait()


def _free_port():
    with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as probe:
        probe.bind(("::", 0))
        return str(probe.getsockname()[1])


def _own_address():
    """Of this machine, and not loopback: there the two ends use a key made for the occasion."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # asks for the way alone, and sends nothing
        except OSError as none:
            raise Skip(f"this machine has no network: {none}")
        return probe.getsockname()[0]


# A slave that root starts becomes somebody else, who may not read what root has here.
_AS_ROOT = {"": "--user root"} if os.geteuid() == 0 else {}
_SHORT = {"": "--seconds 0.5 --no-view"}
_TABLE = (r"^  scene +\S", r"^  haptic loop +\d", r"^  round trip +p50", r"^  poses up +\d+ sent", r"^  faults +\d", r"^report: /.*/report.html$")
_KEY = r"pub_[\w-]{48}"


def every_command_is_played(place):
    told = documented(place.root)
    expect(len(told) > 80, "only", len(told), "commands were found")
    listed = {command for commands in _played.values() for command in commands} | set(_NOT_PLAYED) | {_FIRST_OF_ALL}
    lost = [f"{page}: {command}" for command, page in told.items()
            if command not in listed and not command.startswith(_LOOKED_UP)]
    expect(not lost, "commands of documents that no case plays (tests/first_hour/check_documents.py):\n" + "\n".join(lost))
    expect(not listed - set(told), "in no document any more:", listed - set(told))


def measurements_have_these_options(place):
    told = [command for command in documented(place.root) if command.startswith(_LOOKED_UP)]
    for command in told:
        words = shlex.split(command.replace("[,NAME...]", "").replace(" ...", ""))
        if words[0] == "deploy/measure":
            names = subprocess.run([place.root / words[0], "--list"], text=True, stdout=subprocess.PIPE, check=True).stdout.split()
            expect(words[1] in names, command)
            continue
        if not (place.programs / words[0]).exists():
            raise Skip("farfeel-bench is not built")
        named = [word for word in words[1:3] if re.fullmatch(r"[a-z][a-z-]+", word)]
        apart = f"{words[0]}-{named[0]}"  # one that is a program of its own
        helped = place.run(apart, "--help") if (place.programs / apart).exists() else place.run(words[0], *named, "--help")
        expect(helped.returncode == 0, command, helped.stdout)
        for option in (word for word in words if word.startswith("--")):
            expect(re.search(rf"{option}\b", helped.stdout), command, "has no", option, helped.stdout)


@plays("deploy/run", "deploy/run --scene block-gear --seconds 5", "deploy/run --help", 'deploy/run --link "rtt=50ms jitter=5ms loss=1%"')
def first_run(desk):
    # deploy/run builds first, and hands its arguments on.
    as_built = {"deploy/run": "farfeel loopback"}
    desk.type("deploy/run", r"^scene file-cad", *_TABLE, put={**as_built, **_SHORT})
    desk.type("deploy/run --scene block-gear --seconds 5", r"^scene block-gear", *_TABLE, put={**as_built, "--seconds 5": "--seconds 0.5"})
    desk.type('deploy/run --link "rtt=50ms jitter=5ms loss=1%"', r"^link: rtt=50ms", *_TABLE, put={**as_built, **_SHORT})
    desk.type("deploy/run --help", r"--link", r"--seconds", put={"deploy/run": str(desk.place.root / "deploy" / "run")})
    latest = desk.place.home / "out" / "loopback" / "latest"
    for name in ("report.html", "summary.json", "session.csv", "scene.png", "contacts.png", "slave.log", "master.log"):
        expect((latest / name).stat().st_size > 0, name)
    json.loads((latest / "summary.json").read_text())


@plays("farfeel loopback", "farfeel doctor", "farfeel loopback --scene living", "farfeel loopback --scene block-gear",
       "farfeel loopback --rung RUNG --seconds S --seed N [--link LINK]")
def sessions_on_this_machine(desk):
    desk.type("farfeel loopback", *_TABLE, put=_SHORT)
    desk.type("farfeel loopback --scene block-gear", *_TABLE, put=_SHORT)
    desk.type("farfeel loopback --scene living", *_TABLE, put=_SHORT)
    desk.type("farfeel loopback --rung RUNG --seconds S --seed N [--link LINK]", *_TABLE,
              put={"RUNG": "linear", "--seconds S": "--seconds 0.5", "--seed N": "--seed 2", "[--link LINK]": '--link "rtt=10ms"'})
    desk.type("farfeel doctor", r"^(ok|limited) +processor", r"^(ok|limited) +loop jitter", r"This machine can run farfeel loopback\.")


@plays("build/release/bin/farfeel bake part.stl --unit mm -o part.glb", "build/release/bin/farfeel asset picture part.glb -o part.png",
       "build/release/bin/farfeel loopback --object part.glb", "deploy/run --object part.glb", "farfeel scene list", "farfeel scene check")
def a_mesh_of_mine(desk):
    (desk.place.home / "part.stl").write_text(_slab(0.04 * 1e3, 0.03 * 1e3, 0.01 * 1e3))
    desk.type("build/release/bin/farfeel bake part.stl --unit mm -o part.glb", r"part.glb", r"40\S* x 30\S* x 10\S* mm")
    desk.type("build/release/bin/farfeel asset picture part.glb -o part.png")
    expect((desk.place.home / "part.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n")
    desk.type("build/release/bin/farfeel loopback --object part.glb", r"^scene part.glb with scan-probe", *_TABLE, put=_SHORT)
    desk.type("deploy/run --object part.glb", *_TABLE, put={"deploy/run": "farfeel loopback", **_SHORT})
    expect("file-cad" in desk.type("farfeel scene list").split())
    scene = re.search(r"^```toml\n(title = .*?)^```", (desk.place.root / "README.md").read_text(), re.MULTILINE | re.DOTALL)
    expect(scene, "README shows no scene")
    (desk.place.home / "mine.toml").write_text(scene[1])
    desk.type("farfeel scene check", r"1 objects", r"^ +load +\d", put={"": "mine.toml"})


@plays("build/release/bin/farfeel-slave --scene file-cad --listen 127.0.0.1:47000",
       "build/release/bin/farfeel-master --connect 127.0.0.1:47000 --device simulated --seconds 20 --out out/session",
       "farfeel-bench session out/loopback/latest/session.csv", "farfeel link-status", "farfeel view", "farfeel view --pause")
def two_terminals(desk):
    port = _free_port()
    desk.start("build/release/bin/farfeel-slave --scene file-cad --listen 127.0.0.1:47000", "serving ", put={"47000": port, **_AS_ROOT})
    command = "build/release/bin/farfeel-master --connect 127.0.0.1:47000 --device simulated --seconds 20 --out out/session"
    said = desk.start(command, "received: ", put={"47000": port, "--seconds 20": "--seconds 100"})
    end = time.monotonic() + PATIENCE_S
    while "round trip p50" not in desk.type("farfeel link-status", r"^master \d+", r"^slave \d+"):  # a station tells four times a second
        expect(time.monotonic() < end, "the session does not begin")
        time.sleep(0.25)
    desk.type("farfeel link-status", r"haptic lane: heard")
    view = desk.start("farfeel view", r"http://127\.0\.0\.1:\d+")
    expect(view.exists() and desk.stop() == 0, "the view did not end in order")
    desk.type("farfeel view --pause")
    desk.wait_for(said, "pause")
    expect(desk.stop() == 0, said.read_text())
    desk.wait_for(said, _TABLE[0])
    if not (desk.place.programs / "farfeel-bench").exists():
        raise Skip("farfeel-bench is not built")
    desk.type("farfeel-bench session out/loopback/latest/session.csv", r"p50", put={"loopback/latest": "session"})


@plays("farfeel key new", "farfeel key show", "farfeel key list", "farfeel key trust operator anna pub_...", "farfeel key trust slave lab pub_...",
       "farfeel-slave --scene file-cad --listen 0.0.0.0:47000", "farfeel-master --connect lab.example.org:47000 --slave lab",
       "build/release/bin/farfeel-slave --scene file-cad --listen 0.0.0.0:47000", "build/release/bin/farfeel-master --connect lab.example.org:47000",
       "farfeel-master --connect HOST --device NAME[:SERIAL]", "farfeel doctor --to lab.example.org:47000",
       "farfeel link-status --watch", "farfeel-relay --help", "farfeel-relay serve", "farfeel-relay token --days 30 > token", "farfeel-relay token",
       "farfeel-slave --scene file-cad --relay relay.example.org --relay-token token",
       "farfeel-master --relay relay.example.org --relay-token token --slave lab")
def two_machines(desk):
    _trust_each_other(desk)
    slave, operator = desk.at("slave"), desk.at("operator")
    port, short = _free_port(), {"": "--device simulated --seconds 0.5 --no-view"}
    here = {"lab.example.org:47000": f"{_own_address()}:{port}"}
    for listens, connects in (("farfeel-slave --scene file-cad --listen 0.0.0.0:47000", "farfeel-master --connect lab.example.org:47000 --slave lab"),
                              ("build/release/bin/farfeel-slave --scene file-cad --listen 0.0.0.0:47000",
                               "build/release/bin/farfeel-master --connect lab.example.org:47000")):
        desk.start(listens, "serving ", put={"47000": port, **_AS_ROOT}, machine=slave)
        desk.type(connects, *_TABLE[:-1], r"sealed with", put={**here, **short}, machine=operator)
        if listens.startswith("farfeel"):
            desk.start("farfeel link-status --watch", r"haptic lane", machine=slave)
            desk.stop()
            desk.type("farfeel-master --connect HOST --device NAME[:SERIAL]", *_TABLE[:-1],
                      put={"HOST": f"{_own_address()}:{port}", "NAME[:SERIAL]": "simulated:falcon", "": "--seconds 0.5 --no-view"}, machine=operator)
            _look_at_link(desk, here, operator)
        expect(desk.stop() == 0, "the slave did not end in order")

    relay = _free_port()
    desk.type("farfeel-relay --help", r"farfeel-relay serve")
    desk.start("farfeel-relay serve", r"\d", put={"": f"--listen 127.0.0.1:{relay}"})
    desk.type("farfeel-relay token --days 30 > token")
    desk.type("farfeel-relay token", r"^\S+$")
    at_relay = {"relay.example.org": f"127.0.0.1:{relay}"}
    desk.start("farfeel-slave --scene file-cad --relay relay.example.org --relay-token token", "masters may come over the relay",
               put={**at_relay, **_AS_ROOT, "--scene": "--listen 127.0.0.1:0 --scene"}, machine=slave)
    desk.type("farfeel-master --relay relay.example.org --relay-token token --slave lab", r"connected over the relay at 127\.0\.0\.1",
              put={**at_relay, **short}, machine=operator)


def _look_at_link(desk, here, operator):
    found = ("round trip", "loss", r"packet size \(MTU\)", r"marks \(DSCP\)", "texture")
    doctor = "farfeel doctor --to lab.example.org:47000"
    desk.type(doctor, *(rf"^(ok|limited) +{what} +\S" for what in found), r"^A scene there can be felt from here", put=here, machine=operator)
    told = json.loads(desk.type(doctor, put={**here, "": "--json --seconds 2"}, machine=operator))
    expect(told["is_all_there"] and {"round trip", "texture"} <= {finding["what"] for finding in told["findings"]}, told)


def _trust_each_other(desk):
    slave, operator = desk.at("slave"), desk.at("operator")
    desk.type("farfeel key new", r"^fingerprint +(\d{5} ?){6}$", rf"farfeel key trust slave \S+ {_KEY}$", machine=slave)
    desk.type("farfeel key new", rf"farfeel key trust operator \S+ {_KEY}$", machine=operator)
    keys = [re.search(_KEY, desk.type("farfeel key show", rf"^public key +{_KEY}$", machine=machine))[0] for machine in (slave, operator)]
    desk.type("farfeel key trust operator anna pub_...", r"anna", put={"pub_...": keys[1]}, machine=slave)
    desk.type("farfeel key trust slave lab pub_...", r"lab", put={"pub_...": keys[0]}, machine=operator)
    desk.type("farfeel key list", r"^slaves.*:\n +lab +(\d{5} ?){6}", machine=operator)
    return keys


@plays("farfeel slave --scene living --editable", "farfeel slave --editable",
       "farfeel scene edit ... --durable",
       "farfeel scene edit stamp block --at 0 0 0.02 --radius 0.01 --depth 0.0005", "farfeel scene watch --seconds 5",
       "farfeel scene save -o stamped", "farfeel asset picture stamped/block.glb -o stamp.png", "farfeel scene save", "farfeel slave --scene stamped/scene.toml")
def edits(desk):
    port = _free_port()
    desk.start("farfeel slave --scene living --editable", "serving ", put={"": " ".join(["--listen", f"127.0.0.1:{port}", *_AS_ROOT.values()])})
    here = f"--connect 127.0.0.1:{port}"
    desk.type("farfeel scene edit stamp block --at 0 0 0.02 --radius 0.01 --depth 0.0005", r"'block' is stamped, 0\.50 mm deep \(version 1",
              put={"": here})
    desk.type("farfeel scene watch --seconds 5", r"'living', 2 objects", r"^version 1: 'block' is stamped, 0\.50 mm deep, by",
              put={"--seconds 5": "--seconds 1", "": here})
    desk.type("farfeel scene save -o stamped", r"^stamped: 2 objects and the tool, .* version 1 of the scene", put={"": here})
    desk.type("farfeel asset picture stamped/block.glb -o stamp.png", r"^stamp.png: .*felt surface")
    desk.type("farfeel scene save", r"saved-scene/scene.toml$", put={"": here})
    desk.start("farfeel slave --scene stamped/scene.toml", "serving ", put={"": " ".join(["--listen", "127.0.0.1:0", *_AS_ROOT.values()])})
    desk.stop()
    desk.type("farfeel scene edit ... --durable", r"farfeel slave --state DIR keeps", put={"...": f"revert block {here}"}, status=1)
    desk.type("farfeel slave --editable", r"--editable", put={"": "--help"})


@plays("farfeel key new", "farfeel key show", "farfeel key list", "farfeel key trust operator anna pub_...", "farfeel key trust slave lab pub_...",
       "farfeel key", "farfeel key trust operator NAME KEY", "farfeel key trust slave NAME KEY", "farfeel key trust ... --expires 2027-01-31",
       "farfeel key trust ... --psk psk_...", "farfeel key trust operator ... --role operate,edit", "farfeel key revoke NAME", "farfeel key psk", "farfeel key psk > psk.txt",
       "farfeel key trust operator anna pub_... --psk - < psk.txt", "farfeel key trust slave lab pub_... --psk - < psk.txt", "rm psk.txt")
def keys(desk):
    desk.type("farfeel key", r"key new", r"key trust", put={"": "--help"})
    slaves, operators = _trust_each_other(desk)
    slave, operator = desk.at("slave"), desk.at("operator")
    desk.type("farfeel key trust operator NAME KEY", r"trusted already, as anna", put={"NAME": "bert", "KEY": operators}, machine=slave, status=1)  # anna has it
    desk.type("farfeel key trust slave NAME KEY", r"lab", put={"NAME": "lab", "KEY": slaves}, machine=operator)
    desk.type("farfeel key trust ... --expires 2027-01-31", put={"...": f"operator anna {operators}", "2027-01-31": "2099-01-31"}, machine=slave)
    desk.type("farfeel key list", r"anna .*2099-01-31", machine=slave)
    psk = desk.type("farfeel key psk", r"^psk_[\w-]{48}$").strip()
    desk.type("farfeel key trust ... --psk psk_...", put={"trust ...": f"trust operator anna {operators}", "psk_...": psk}, machine=slave)
    desk.type("farfeel key list", r"anna .* psk$", machine=slave)
    desk.type("farfeel key trust operator ... --role operate,edit", r"may operate,edit$", put={"...": f"anna {operators}"}, machine=slave)
    desk.type("farfeel key psk > psk.txt")
    desk.type("farfeel key trust operator anna pub_... --psk - < psk.txt", put={"pub_...": operators}, machine=slave)
    desk.type("farfeel key trust slave lab pub_... --psk - < psk.txt", put={"pub_...": slaves}, machine=operator)
    desk.type("rm psk.txt")
    desk.type("farfeel key revoke NAME", r"anna", put={"NAME": "anna"}, machine=slave)
    desk.type("farfeel key list", r"^operators.*:\n +nobody", machine=slave)


@plays("farfeel device list", "farfeel device watch", "farfeel device watch NAME[:SERIAL]", "farfeel device calibrate NAME[:SERIAL]",
       "farfeel device test NAME[:SERIAL]", "farfeel device identify-limits NAME[:SERIAL]", "farfeel doctor")
def devices(desk):
    # Whatever is plugged in here, there is no device with such a number.
    none = {"NAME[:SERIAL]": "falcon:no-such-number"}
    desk.type("farfeel device list", r"(No haptic device is plugged in|^\S+)")
    desk.start("farfeel device watch", r" position_mm=\S+ .* reports_Hz=")
    expect(desk.stop() == 0)
    desk.start("farfeel device watch NAME[:SERIAL]", r"^falcon:no-such-number absent .*no falcon", put=none)
    desk.stop()
    for command in ("calibrate", "test", "identify-limits"):
        desk.start(f"farfeel device {command} NAME[:SERIAL]", r"no falcon with serial number no-such-number", put=none)
        desk.stop()  # it waits for the plug
    desk.type("farfeel doctor", r"^(ok|limited|missing) +device rules", r"^(ok|limited|missing) +haptic devices")


@plays("farfeel master", "farfeel config", "farfeel config docs", "farfeel config show master --origin", "farfeel config check")
def settings(desk):
    desk.type("farfeel master", r"--connect", r"--device", put={"": "--help"})
    desk.type("farfeel config", r"show", r"check", put={"": "--help"})
    desk.type("farfeel config docs", r"^# Options$", r"^## farfeel master$")
    shown = re.search(r"^```toml\n(.*?)^```", (desk.place.root / "docs" / "options.md").read_text(), re.MULTILINE | re.DOTALL)
    expect(shown, "options.md shows no file")
    file = desk.place.setting("master.toml", shown[1])
    desk.type("farfeel config show master --origin", rf"^  --max-force +4\.5 .*{re.escape(str(file))}:1$", r"^  --rate +1000 .*default$")
    desk.type("farfeel config check", rf"^{re.escape(str(file))}: right")


def _slab(x, y, z):
    """A box with its corner at the origin, as STL text."""
    corners = [(i & 1 and x, i & 2 and y, i & 4 and z) for i in range(8)]
    faces = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    text = "solid slab\n"
    for a, b, c, d in faces:
        for triangle in ((a, b, c), (a, c, d)):
            points = "".join("vertex {} {} {}\n".format(*corners[i]) for i in triangle)
            text += f"facet normal 0 0 0\nouter loop\n{points}endloop\nendfacet\n"
    return text + "endsolid slab\n"


if __name__ == "__main__":
    sys.exit(run_cases(globals()))
