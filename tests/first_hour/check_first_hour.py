"""What trips a new user in the first hours: a case is a function that takes a Place, and is one test.

python3 tests/first_hour/check_first_hour.py --programs build/release/bin --root . options_page_is_made_of_the_programs
"""

import fcntl
import math
import os
import pathlib
import pty
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import time

from place import PATIENCE_S, Skip, expect, run_cases

_USAGE = 2
_ABOVE = """tool_point_m = [0.0, 0.0, -0.01]
tool_normal = [0.0, 0.0, -1.0]
region_low_m = [-0.005, -0.005, 0.01]
region_high_m = [0.005, 0.005, 0.01]
approach = [0.0, 0.0, -1.0]
stroke_speed_m_per_s = 0.05
"""


def shown(place, program, option, **variables):
    """Value and origin of an option, as `farfeel config show` tells them."""
    told = place.run("farfeel", "config", "show", program, "--origin", **variables)
    expect(told.returncode == 0, told.stdout)
    row = next(line for line in told.stdout.splitlines() if line.startswith(f"  {option} "))
    words = row.split()
    return words[1], words[-1]


def settings_count_in_their_order(place):
    expect(shown(place, "master", "--rate") == ("1000", "default"), shown(place, "master", "--rate"))
    file = place.setting("master.toml", "# mine\nrate = 2000\n")
    expect(shown(place, "master", "--rate") == ("2000", f"{file}:2"))
    expect(shown(place, "master", "--rate", FARFEEL_RATE="4000") == ("4000", "FARFEEL_RATE"))
    moved = place.home / "elsewhere" / "farfeel"
    moved.mkdir(parents=True)
    (moved / "master.toml").write_text("rate = 5000\n")
    expect(shown(place, "master", "--rate", XDG_CONFIG_HOME=str(moved.parent)) == ("5000", f"{moved}/master.toml:1"))


def a_setting_has_its_effect(place):
    place.setting("link.toml", 'listen = "127.0.0.1:0"\nseconds = 0.1\n')
    ended = place.run("farfeel-link")  # without the file it would go on until it is stopped
    expect(ended.returncode == 0 and '"seconds"' in ended.stdout, ended.stdout)
    ended = place.run("farfeel-link", "--listen", "nonsense")
    expect(ended.returncode != 0 and "nonsense" in ended.stdout, "the command line comes first:", ended.stdout)


def loopback_stations_take_no_settings(place):
    place.setting("slave.toml", "nonsense = 1\n")
    told = place.run("farfeel", "loopback", "--scene", "no-such-scene", "--out", str(place.home / "out"))
    expect(told.returncode == 1 and "no-such-scene" in told.stdout and "nonsense" not in told.stdout, told.stdout)
    told = place.run("farfeel", "slave", "--scene", "no-such-scene")
    expect(told.returncode == _USAGE and "nonsense" in told.stdout, told.stdout)


def a_wrong_key_is_told_with_file_and_line(place):
    file = place.setting("master.toml", "rate = 2000\nmax-frce = 3\n")
    told = place.run("farfeel-master", "--connect", "127.0.0.1:1")
    expect(told.returncode == _USAGE, told.returncode)
    expect(f'{file}:2: there is no option "max-frce"; did you mean "max_force"?' in told.stdout, told.stdout)
    expect(place.run("farfeel-master", "--help").returncode == 0, "help needs no settings")


def a_wrong_value_is_told_with_file_and_line(place):
    for text in ("max_force = 9e9\n", "max_force = nan\n", 'max_force = "much"\n', "max_force = [1]\n"):
        file = place.setting("master.toml", "rate = 2000\n" + text)
        told = place.run("farfeel-master", "--connect", "127.0.0.1:1")
        expect(told.returncode == _USAGE and f"{file}:2: " in told.stdout, text, told.stdout)
    place.setting("master.toml", "")
    told = place.run("farfeel-master", "--connect", "127.0.0.1:1", FARFEEL_MAX_FORCE="much")
    expect(told.returncode == _USAGE and "FARFEEL_MAX_FORCE: " in told.stdout, told.stdout)


def what_others_may_write_is_refused(place):
    file = place.setting("master.toml", 'plug_in = "/tmp/evil.so"\n')
    file.chmod(0o666)
    told = place.run("farfeel-master", "--connect", "127.0.0.1:1")
    expect(told.returncode == _USAGE and f"chmod go-w '{file}'" in told.stdout, told.stdout)
    file.chmod(0o644)
    file.parent.chmod(0o777)
    told = place.run("farfeel-master", "--connect", "127.0.0.1:1")
    expect(told.returncode == _USAGE and f"chmod go-w '{file.parent}'" in told.stdout, told.stdout)


def what_a_caller_of_sudo_wrote_is_passed_over(place):
    if os.geteuid() != 0:
        raise Skip("only root can have somebody else's files at hand")
    file = place.setting("master.toml", "rate = 2000\n")
    os.chown(file, 12345, 12345)
    expect(shown(place, "master", "--rate", SUDO_UID="12345") == ("1000", "default"))
    told = place.run("farfeel", "config", "show", "master")
    expect(told.returncode == _USAGE and "belongs to user 12345" in told.stdout, told.stdout)


def config_check_names_what_is_wrong(place):
    told = place.run("farfeel", "config", "check")
    expect(told.returncode == 0 and "no files of settings in" in told.stdout, told.stdout)
    right, wrong = place.setting("link.toml", "seconds = 1\n"), place.setting("slave.toml", "grid = 8\nlissen = 3\n")
    told = place.run("farfeel", "config", "check")
    expect(told.returncode == _USAGE, told.stdout)
    expect(f"{right}: right" in told.stdout and f'{wrong}:2: there is no option "lissen"' in told.stdout, told.stdout)
    expect(place.run("farfeel", "config", "check", str(right)).returncode == 0)
    wrong.unlink()
    strange = place.setting("mastr.toml", "rate = 2000\n")
    told = place.run("farfeel", "config", "check")
    expect(told.returncode == _USAGE, told.stdout)
    expect(f'{strange}: there is no program "mastr"; did you mean "master"?' in told.stdout, told.stdout)
    told = place.run("farfeel", "config", "show", "mastr")
    expect(told.returncode == _USAGE and 'did you mean "master"?' in told.stdout, told.stdout)


def config_check_names_wrong_variables(place):
    told = place.run("farfeel", "config", "check", FARFEEL_MAX_FORCE="3", FARFEEL_MAX_FROCE="3")
    expect(told.returncode == _USAGE, told.stdout)
    expect("FARFEEL_MAX_FROCE: no program has such an option; did you mean FARFEEL_MAX_FORCE?" in told.stdout, told.stdout)
    expect("FARFEEL_MAX_FORCE: " not in told.stdout, told.stdout)


def two_sessions_share_no_folder(place):
    folder = place.home / "out"
    folder.mkdir()
    held = os.open(folder, os.O_RDONLY)
    fcntl.flock(held, fcntl.LOCK_EX)
    for command in (("farfeel", "loopback", "--scene", "no-such-scene"), ("farfeel-master", "--connect", "127.0.0.1:1")):
        told = place.run(*command, "--out", str(folder))
        expect(told.returncode == 1 and f"another session that runs now writes into {folder}" in told.stdout, told.stdout)
    os.close(held)
    told = place.run("farfeel", "loopback", "--scene", "no-such-scene", "--out", str(folder))
    expect("another session" not in told.stdout and "no-such-scene" in told.stdout, told.stdout)


def a_wrong_scene_takes_nothing_away(place):
    folder = place.home / "out"
    folder.mkdir()
    for name in ("report.html", "summary.json", "session.csv", "link.log"):
        (folder / name).write_text("of an older run")
    told = place.run("farfeel", "loopback", "--scene", "no-such-scene", "--out", str(folder))
    expect(told.returncode == 1, told.stdout)
    for name in ("report.html", "summary.json", "session.csv", "link.log"):
        expect((folder / name).read_text() == "of an older run", name)
    expect(place.run("farfeel", "loopback", "--seconds", "nan").returncode == _USAGE)
    expect(not (place.home / "out" / "loopback").exists(), "a wrong command line makes no folder")


def each_run_has_its_folder(place):
    for count in (1, 2):
        place.run("farfeel", "loopback", "--scene", "no-such-scene")
        runs = list((place.home / "out" / "loopback").iterdir())
        expect(len(runs) == count and all((run / "slave.log").exists() for run in runs), runs)


def wrong_arguments_end_with_2(place):
    for command, words in ((("farfeel", "loopback", "--secnds", "3"), 'did you mean "--seconds"?'),
                           (("farfeel", "loopback", "--seconds", "nan"), "nan is not a finite number"),
                           (("farfeel", "loopback", "--seed", "-1"), "-1 is negative"),
                           (("farfeel", "lopback",), 'did you mean "farfeel loopback"?'),
                           (("farfeel", "key", "lits"), 'did you mean "farfeel key list"?'),
                           (("farfeel-master", "--seconds", "1e9"), "--seconds"),
                           (("farfeel-master", "--grip", "iron"), "--grip"),
                           (("farfeel-master", "--rung", "tils"), '--rung: there is no "tils"; did you mean "tiles"? There are auto, held,'),
                           (("farfeel", "loopback", "--link", "rtt=50ms jiter=5ms"), "--link: cannot read the link: there is no 'jiter'; did you mean 'jitter'?"),
                           (("farfeel", "loopback", "--link", "rt=20ms"), "there is no 'rt'; did you mean 'rtt'?"),
                           (("farfeel-slave", "--grid", "-1"), "--grid"),
                           (("farfeel-slave", "--lissten", "x"), 'did you mean "--listen"?'),
                           (("farfeel-link", "--seconds", "inf"), "--seconds"),
                           (("farfeel-relay", "srve"), 'did you mean "serve"?'),
                           (("farfeel-device", "lst"), 'did you mean "list"?'),
                           (("farfeel", "loopback", "--penetration", "simdd"), 'did you mean "simd"?'),
                           (("farfeel", "scene", "chek"), 'did you mean "check"?'),
                           (("farfeel", "scene", "edti"), 'did you mean "edit"?'),
                           (("farfeel", "scene", "edit", "stmp"), 'did you mean "stamp"?'),
                           (("farfeel-asset", "inf", "x"), 'did you mean "info"?'),
                           (("farfeel-view", "--prot", "1"), 'did you mean "--port"?'),
                           (("farfeel-bake", "--modl", "x"), 'did you mean "--model"?'),
                           (("farfeel-replay", "--withn", "1"), 'did you mean "--within"?')):
        told = place.run(*command)
        expect(told.returncode == _USAGE and words in told.stdout, command, told.returncode, told.stdout)
    expect(not list(place.home.iterdir()), "nothing is written before the arguments are right")


def a_wrong_measurement_ends_with_2(place):
    if not (place.programs / "farfeel-bench").exists():
        raise Skip("farfeel-bench is not built")
    for command, words in (((), "subcommand"), (("lop",), 'did you mean "loop"?'), (("loop", "--qick"), 'did you mean "--quick"?'),
                           (("count", "--chek", "x"), 'did you mean "--check"?'), (("stability", "--jsn"), 'did you mean "--json"?')):
        told = place.run("farfeel-bench", *command)
        expect(told.returncode == _USAGE and words in told.stdout, command, told.returncode, told.stdout)


def every_program_says_what_it_is(place):
    for program in sorted(place.programs.glob("farfeel*")):
        if program.name.startswith("farfeel-bench"):  # what measures is not what a newcomer runs
            continue
        told = place.run(program.name, "--version")
        expect(told.returncode == 0 and "kernel: Linux" in told.stdout and "instruction set: " in told.stdout, told.stdout)
    for name in ("bake", "loopback", "key", "config"):
        helped, asked = place.run("farfeel", "help", name), place.run("farfeel", name, "--help")
        expect(helped.returncode == 0 and helped.stdout == asked.stdout and name in asked.stdout, name, helped.stdout)


def a_wrong_device_is_told_before_anything_begins(place):
    for words, told_words in ((("--device", "falcno"), "falcno"), (("--device", "simulated:falcno"), "did you mean falcon?"),
                              (("--orientation", "spacmouse"), "spacmouse"),
                              (("--plug-in", "/etc/passwd"), "invalid ELF header"),
                              (("--plug-in", "/no/such.so"), "/no/such.so")):
        told = place.run("farfeel-master", "--connect", "127.0.0.1:1", *words)
        expect(told.returncode == 1 and told_words in told.stdout and "greeting" not in told.stdout, words, told.stdout)
    expect(not (place.home / "out").exists(), "no folder is made for it")


def little_memory_is_told(place):
    served(place)  # bakes: a library that has no memory there ends without a word
    told = place.run("sh", "-c", 'ulimit -v 150000; exec "$@"', "sh", str(place.programs / "farfeel-slave"), "--scene",
                     blocks(place), "--listen", "127.0.0.1:0")
    expect(told.returncode == 1 and "out of memory; its address space is limited to 146 MB (ulimit -v)" in told.stdout,
           told.returncode, told.stdout)


def a_bake_without_memory_says_why(place):
    for megabytes in (80, 100, 120, 150, 200, 300):
        told = place.run("sh", "-c", f'ulimit -v {megabytes}000; exec "$@"', "sh", str(place.programs / "farfeel-bake"),
                         "--model", "block", "-o", str(place.home / "block.glb"))
        if told.returncode != 0:
            expect(told.returncode == 1 and "out of memory; its address space is limited to" in told.stdout, megabytes,
                   told.returncode, told.stdout)


def a_terminal_gets_no_colour_that_it_does_not_want(place):
    command = f"'{place.programs}/farfeel-slave' --scene none"
    for wish, has_colour in (({}, True), ({"NO_COLOR": "1"}, False)):
        told = place.run("script", "-qec", command, "/dev/null", **wish)
        expect("no scene 'none'" in told.stdout and ("\x1b[" in told.stdout) == has_colour, wish, repr(told.stdout))


def a_wrong_scene_is_told_with_the_nearest(place):
    told = place.run("farfeel-slave", "--scene", "file-cda")
    expect(told.returncode == 1 and "did you mean file-cad?" in told.stdout, told.stdout)
    told = place.run("farfeel-bake", "--model", "gera", "-o", str(place.home / "gear.glb"))
    expect(told.returncode == 1 and "there is no model gera, did you mean gear?" in told.stdout, told.stdout)
    told = place.run("farfeel-scene", "check", "block-gera")
    expect(told.returncode == 1 and "did you mean block-gear?" in told.stdout, told.stdout)


def blocks(place):
    """A scene of what is baked in a second or two."""
    scene = place.home / "blocks.toml"
    scene.write_text('title = "Blocks"\n[tool]\nmodel = "block"\n[[object]]\nmodel = "block"\n')
    return str(scene)


def served(place, *, without=(), **variables):
    """What a slave says until it serves, which it has to."""
    environment = {k: v for k, v in place.environment(**variables).items() if k not in without}
    slave = subprocess.Popen([str(place.programs / "farfeel-slave"), "--scene", blocks(place), "--listen",
                              "127.0.0.1:0"], cwd=place.home, text=True, env=environment, stdin=subprocess.DEVNULL,
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    said = ""
    for line in slave.stdout:
        said += line
        if "serving 'Blocks'" in line:
            break
    slave.terminate()
    said += slave.communicate(timeout=PATIENCE_S)[0]
    expect("serving 'Blocks'" in said and slave.returncode == 0, slave.returncode, said)
    return said


def a_cache_that_cannot_be_written_is_told(place):
    (place.home / "file").write_text("no folder")
    said = served(place, XDG_CACHE_HOME=str(place.home / "file"))
    expect(f"the cache folder {place.home}/file/farfeel cannot be used" in said, said)
    expect("cannot be used" not in served(place))


def without_a_home_it_runs(place):
    served(place, without=("HOME",), TMPDIR=str(place.home))
    told = place.run("env", "-u", "HOME", str(place.programs / "farfeel"), "config", "show", "link")
    expect(told.returncode == 0 and "--listen" in told.stdout, told.stdout)
    told = place.run("env", "-u", "HOME", str(place.programs / "farfeel"), "key", "list")
    expect(told.returncode == 1 and "HOME" in told.stdout, told.stdout)


def a_scene_is_checked_with_its_assets(place):
    scene = place.home / "scene.toml"
    scene.write_text('title = "Mine"\n[tool]\nmodel = "block"\n[[object]]\nasset = "part.glb"\n')
    (place.home / "part.glb").write_text("no asset at all")
    told = place.run("farfeel-scene", "check", str(scene))
    expect(told.returncode == 1 and "part.glb" in told.stdout and "too short for a .glb" in told.stdout, told.stdout)
    expect(place.run("farfeel-scene", "check", "--load-within", "0", str(scene)).returncode == 0)
    told = place.run("farfeel-scene", "check", blocks(place))
    expect(told.returncode == 0 and "load " in told.stdout and "1 objects of 2 convex pieces" in told.stdout, told.stdout)
    shutil.rmtree(place.home / ".cache")
    told = place.run("farfeel-scene", "check", blocks(place), "--load-within", "0.01")
    expect(told.returncode == 1 and "not done after 0.01 s" in told.stdout and "Blocks" in told.stdout, told.stdout)


def what_a_hand_cannot_press_is_told(place):
    scene = pathlib.Path(blocks(place))
    scene.write_text(scene.read_text() + "[exploration]\npress_force_N = 20.0\n" + _ABOVE)
    told = place.run("farfeel", "loopback", "--scene", str(scene), "--seconds", "0.5", "--no-view")
    expect("mind: the scene asks to press with 20 N: the device gives 8 N at most" in told.stdout, told.stdout)
    scene.write_text(scene.read_text().replace("20.0", "7.0"))
    told = place.run("farfeel", "loopback", "--scene", str(scene), "--seconds", "0.5", "--no-view")
    expect("mind: the scene asks to press with 7 N" in told.stdout and "lifts at some 6.9 N" in told.stdout, told.stdout)
    scene.write_text(scene.read_text().replace("7.0", "4.0"))
    told = place.run("farfeel", "loopback", "--scene", str(scene), "--seconds", "0.5", "--no-view")
    expect(told.returncode == 0 and "mind: " not in told.stdout, told.stdout)


def an_echo_is_told_as_one(place):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as echo:
        echo.bind(("127.0.0.1", 0))
        master = subprocess.Popen([str(place.programs / "farfeel-master"), "--connect", f"127.0.0.1:{echo.getsockname()[1]}"],
                                  cwd=place.home, text=True, env=place.environment(), stdin=subprocess.DEVNULL,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        echo.settimeout(0.2)
        while master.poll() is None:
            try:
                datagram, sender = echo.recvfrom(65535)
                echo.sendto(datagram, sender)
            except TimeoutError:
                pass
        said = master.communicate()[0]
    expect(master.returncode == 1 and "echo service, not farfeel-slave" in said and "nothing comes back" not in said, said)
    lines = [line.split(" ", 1)[1] for line in said.splitlines()]
    expect(len(set(lines)) == len(lines), "a line is said twice:", said)


def over(place, link, seconds):
    """What a loopback says, and its master's log, over such a link."""
    told = place.run("farfeel", "loopback", "--scene", blocks(place), "--seconds", str(seconds), "--link", link, "--no-view")
    return told.returncode, told.stdout, (place.home / "out" / "loopback" / "latest" / "master.log").read_text()


def packets_that_are_cut_off_are_told(place):
    status, said, log = over(place, "mtu=576", 1)
    longest = re.search(r"none longer than (\d+) bytes, and the scene comes in datagrams of 1200", log)
    expect(status == 1 and longest and longest[0] in said and int(longest[1]) <= 576 - 28 and "MTU of 1280" in said, status, said, log)


def a_link_that_is_too_far_is_told(place):
    status, said, log = over(place, "rtt=1500ms", 6)
    words = "and what is older than 1.25 s is not felt"
    expect(status == 0 and "mind: the round trip to the slave takes 1.5" in said and words in said and words in log, status, said, log)


def a_link_that_is_too_narrow_is_told(place):
    status, said, log = over(place, "rtt=60ms rate=500kbit queue=400ms", 10)
    expect(status == 0 and "mind: the link is too narrow" in said and "--rate 250" in said, status, said)
    grown = re.search(r"grown from (\d+) to (\d+) ms .* (\d+) % of the poses .* sends (\S+) Mbit/s and gets (\S+);", log)
    expect(grown and int(grown[1]) < 150 < int(grown[2]), log)
    expect(0.3 < float(grown[4]), "what is sent does not fit into 0.5 Mbit/s:", log)


def a_stop_is_in_order_after_a_bake(place):
    expect("stopping on SIGTERM" in served(place), "the bake's threads let the signal through")


def a_ball(place, rings=120):
    """A file of some 57,000 triangles, unless told otherwise."""
    sides, file = 2 * rings, place.home / "ball.obj"
    at = lambda i, j: 1 if i == 0 else (rings - 1) * sides + 2 if i == rings else (i - 1) * sides + j % sides + 2
    with file.open("w") as out:
        for i in range(rings + 1):
            for j in range(sides if 0 < i < rings else 1):
                polar, turn = math.pi * i / rings, 2 * math.pi * j / sides
                r = 0.03 + 2e-4 * math.sin(9 * polar) * math.sin(7 * turn)
                out.write(f"v {r * math.sin(polar) * math.cos(turn)} {r * math.sin(polar) * math.sin(turn)} {r * math.cos(polar)}\n")
        for i in range(rings):
            for j in range(sides):
                a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
                out.write("".join(f"f {x} {y} {z}\n" for x, y, z in ((a, b, c), (a, c, d)) if len({x, y, z}) == 3))
    return str(file)


def a_bake_is_stopped_in_every_stage(place):
    """Ctrl-C on its terminal as soon as a stage shows there: it ends, and leaves nothing behind."""
    ball, slowest = a_ball(place), 0
    before = sorted(place.home.iterdir())
    for stage in ("read", "mend", "self-crossings", "bake 1: mass", "simplify", "pieces", "rays", "spectrum", "deviation", "bake 2"):
        pid, terminal = pty.fork()
        if pid == 0:
            os.chdir(place.home)
            signal.signal(signal.SIGINT, signal.SIG_DFL)  # a shell's background job ignores it, and so would this
            os.execve(place.programs / "farfeel-bake", ["farfeel-bake", ball, "-o", "ball.glb"], place.environment())
        shown = b""
        while stage.encode() not in shown:
            more = os.read(terminal, 4096)
            expect(more, "it ended before", stage, shown)
            shown += more
        since = time.monotonic()
        os.write(terminal, b"\x03")
        _, status = os.waitpid(pid, 0)
        slowest = max(slowest, time.monotonic() - since)
        os.close(terminal)
        expect(os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGINT, stage, status)
        expect(sorted(place.home.iterdir()) == before, stage, "left", sorted(place.home.iterdir()))
    print(f"the slowest of them ended {slowest:.3f} s after Ctrl-C")


def a_bake_keeps_to_the_memory_it_may_take(place):
    ball = a_ball(place, 8)
    told = place.run("farfeel-bake", ball, "--memory", "100MB", "-o", "ball.glb")
    expect(told.returncode == 1 and "nothing is baked: ball may take" in told.stdout and "--memory allows 0.1 GB" in told.stdout,
           told.stdout)
    expect(not (place.home / "ball.glb").exists(), "it was baked")
    told = place.run("farfeel-bake", ball, "--memory", "300MB", "--error", "1mm", "-o", "ball.glb")
    expect(told.returncode == 0 and "textures up to 1024 are tried and not up to 4096, as memory allows" in told.stdout, told.stdout)


def an_assembly_becomes_a_scene(place):
    """Two cubes in one file, in centimetres: an asset each, and a scene that has them where the file had them."""
    lines, corners = [], 0
    for name, x in (("left", 0), ('right "one"', 5)):
        lines += [f"o {name}"] + [f"v {x + i % 2 * 2} {i // 2 % 2 * 2} {i // 4 * 2}" for i in range(8)]
        for face in ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)):
            lines.append("f " + " ".join(str(corners + i + 1) for i in face))
        corners += 8
    (place.home / "pair.obj").write_text("\n".join(lines) + "\n")
    made = place.run("farfeel", "bake", "pair.obj", "--unit", "cm", "--parts", "--triangles", "12", "--texture", "64", "-o", "pair")
    expect(made.returncode == 0 and "--scene pair/scene.toml" in made.stdout, made.stdout)
    files = sorted(file.name for file in (place.home / "pair").iterdir())
    expect(files == ["left.glb", "right__one_.glb", "scene.toml"], files)
    checked = place.run("farfeel", "scene", "check", "pair/scene.toml")
    expect(checked.returncode == 0, checked.stdout)
    told = place.run("farfeel", "loopback", "--scene", "pair/scene.toml", "--seconds", "0.5", "--no-view")
    expect(told.returncode == 0 and "report: " in told.stdout, told.stdout)
    none = place.run("farfeel", "bake", "pair.obj", "--unit", "mm", "--parts", "-o", "pair.obj")
    expect(none.returncode == 1 and "-o names a folder" in none.stdout, none.stdout)
    left = (place.home / "pair" / "left.glb").read_bytes()  # whose one part is called left, too
    over = place.run("farfeel", "bake", "pair/left.glb", "--unit", "m", "--parts", "-o", "pair")
    expect(over.returncode == 1 and "would overwrite pair/left.glb itself" in over.stdout, over.stdout)
    expect((place.home / "pair" / "left.glb").read_bytes() == left, "the source is another")


def a_small_stack_is_enough(place):
    told = place.run("sh", "-c", 'ulimit -s 256; exec "$@"', "sh", str(place.programs / "farfeel"), "loopback", "--scene",
                     blocks(place), "--seconds", "0.5", "--no-view")
    expect(told.returncode == 0 and "report: " in told.stdout, told.returncode, told.stdout)
    latest = place.home / "out" / "loopback" / "latest"
    expect((latest / "report.html").exists() and latest.is_symlink(), "the run is not where latest points to")


def run_help_builds_nothing(place):
    told = subprocess.run([str(place.root / "deploy" / "run"), "--help"], text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, cwd=place.home, env=place.environment(), timeout=PATIENCE_S)
    expect(told.returncode == 0 and "--scene" in told.stdout and "building" not in told.stdout, told.stdout)


def a_wrong_option_of_run_builds_nothing(place):
    for words in (("--wrong",), ("--seconds=1", "--secnds=3"), ("--scene", "block-gear", "--no-veiw")):
        told = subprocess.run([str(place.root / "deploy" / "run"), *words], text=True, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, cwd=place.home, env=place.environment(), timeout=PATIENCE_S)
        wrong = words[-1].split("=")[0]
        expect(told.returncode == _USAGE and f"there is no option {wrong}; there are --scene, " in told.stdout
               and "building" not in told.stdout, told.returncode, told.stdout)


def a_wrong_device_boots_no_guest(place):
    told = place.run(str(place.root / "deploy" / "hardware-lab"), "--device", "woodenhaptics")
    expect(told.returncode == _USAGE and "wooden-haptics" in told.stdout, told.returncode, told.stdout)


def a_long_command_is_not_silent_in_a_log(place):
    told = place.run(str(place.root / "deploy" / "say-progress"), str(place.home / "log"), "sh", "-c",
                     "echo waiting for apt, process 7; sleep 20; echo done; exit 3")
    lines = told.stdout.splitlines()
    expect(told.returncode == 3 and lines, told.returncode, told.stdout)
    expect(all(re.fullmatch(r"  \d+ s: waiting for apt, process 7( \.)*", line) for line in lines), told.stdout)
    expect(len(set(lines)) == len(lines), "a line is said twice:", told.stdout)
    expect((place.home / "log").read_text().endswith("done\n"), "the log is another")


def how_far_it_is_is_told(place):
    say, log = str(place.root / "deploy" / "say-progress"), str(place.home / "log")
    for words, told in (("[5/20] Building main.o", "25 %: Building main.o"),
                        ("Unpacking g++\\npmstatus:g++:12.5000:Unpacking g++ (amd64)\\nUnpacking cpp", "12 %: Unpacking g++ (amd64)")):
        long = f"printf '{words}\\n'; sleep 10"
        in_log = place.run(say, log, "sh", "-c", long).stdout
        expect(re.fullmatch(rf"  \d+ s, {re.escape(told)}\n", in_log), in_log)
        on_terminal = place.run("script", "-qec", shlex.join([say, log, "sh", "-c", long]), "/dev/null").stdout
        bar = "#" * (int(told[:2]) // 5)
        expect(f" s [{bar}{'.' * (20 - len(bar))}] {told}\n" in on_terminal, repr(on_terminal))


def a_bench_and_its_build_are_not_silent(place):
    """Both played by scripts that say nothing: in a log a line every few seconds tells who is at work, and the end is theirs."""
    programs = place.home / "release" / "bin"
    programs.mkdir(parents=True)
    shutil.copy(place.programs / "farfeel", programs)
    (programs.parent / "CMakeCache.txt").write_text("")
    tools = place.home / "tools"
    tools.mkdir()
    bench = "#!/bin/sh\nsleep 10\necho measured\nexit 3\n"
    (tools / "cmake").write_text(f"#!/bin/sh\nsleep 10\nprintf '{bench}' > {programs}/farfeel-bench\nchmod +x {programs}/farfeel-bench\n")
    (tools / "cmake").chmod(0o755)
    told = place.run(str(programs / "farfeel"), "bench", "loop", "--quick", PATH=f"{tools}:{os.environ['PATH']}")
    lines = [line for line in told.stdout.splitlines() if not line.startswith("building farfeel-bench: minutes")]
    expect(told.returncode == 3 and len(lines) == 3 and lines[-1] == "measured", told.returncode, told.stdout)
    expect(re.fullmatch(r"  \d+ s: building farfeel-bench", lines[0]), told.stdout)
    expect(re.fullmatch(r"  \d+ s: farfeel-bench loop --quick", lines[1]), told.stdout)


def a_first_run_is_judged(place):
    judge = [str(place.root / "deploy" / "first-run"), "--log", str(place.home / "log"), "--judge", "sh", "-c"]
    as_it_should_be = place.run(*judge, "echo one; echo two")
    expect(as_it_should_be.returncode == 0 and "2 lines" in as_it_should_be.stdout, as_it_should_be.stdout)
    for script, words in (("exit 3", "ended with 3"), ("echo a line; echo a line", "said this line 2 times: 'a line'"),
                          ("seq 61", "said 61 lines, and at most 60"), ("echo slow; sleep 11", "the last line before: 'slow'")):
        judged = place.run(*judge, script)
        expect(judged.returncode == 1 and words in judged.stdout, script, judged.stdout)


def options_page_is_made_of_the_programs(place):
    made = place.run("farfeel", "config", "docs")
    expect(made.returncode == 0, made.stdout)
    page = place.root / "docs" / "options.md"
    expect(made.stdout == page.read_text(), "docs/options.md is another: farfeel config docs > docs/options.md")
    for program in ("loopback", "edit", "master", "slave", "device", "link", "relay", "view", "bake", "key"):
        expect(f"\n## farfeel {program}\n" in made.stdout, program, "is missing")


if __name__ == "__main__":
    sys.exit(run_cases(globals()))
