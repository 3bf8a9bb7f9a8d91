"""The real programs: their keys, their start, what they say."""

import base64
import hashlib
import os
import select
import signal
import subprocess
import time

_CHECKS = {"pub": b"pub-text", "secret": b"sec-text", "psk": b"psk-text"}


def key_bytes(word):
    """The 32 bytes in a word pub_..., secret_... or psk_... (docs/keys.md, "Words")."""
    kind, letters = word.split("_", 1)
    coded = base64.urlsafe_b64decode(letters)
    key, check = coded[:32], coded[32:]
    if hashlib.blake2b(_CHECKS[kind] + key, digest_size=32).digest()[:4] != check:
        raise ValueError("a key's word that is wrong")
    return key


class Programs:
    """Programs of one folder, with key folders and logs in another. Ends what it started."""

    def __init__(self, binaries, folder):
        self.binaries, self.folder = binaries, folder
        self.running = []
        os.makedirs(folder, exist_ok=True)

    def path(self, name):
        return os.path.join(self.folder, name)

    def key(self, end, *arguments, text=None):
        command = [os.path.join(self.binaries, "farfeel"), "key", *arguments]
        if arguments[0] != "psk":
            command += ["--folder", self.path(end)]
        return subprocess.run(command, check=True, capture_output=True, text=True, input=text).stdout

    def new_key(self, end):
        """Makes a key: the secret, and the word of the public one."""
        self.key(end, "new", "--name", end)
        word = self.key(end, "show", "--key-only").strip()
        with open(os.path.join(self.path(end), "identity")) as file:
            secret = next(w for line in file if not line.startswith("#") for w in line.split() if w.startswith("secret_"))
        return key_bytes(secret), word

    def baked(self, name, ply):
        """The asset of a mesh in metres, given as the text of a PLY file."""
        with open(self.path(f"{name}.ply"), "w") as file:
            file.write(ply)
        subprocess.run([os.path.join(self.binaries, "farfeel-bake"), self.path(f"{name}.ply"), "--unit", "m",
                        "--texture", "64", "-o", self.path(f"{name}.glb")], check=True, capture_output=True)
        return self.path(f"{name}.glb")

    def start(self, name, *arguments, ready=False):
        """The process, and with `ready` the port that it serves."""
        log = open(self.path(f"{name}-{len(self.running)}.log"), "wb")
        command = [os.path.join(self.binaries, name), *arguments]
        if not ready:
            process = subprocess.Popen(command, stdout=log, stderr=log)
            self.running.append(process)
            return process, None
        read_end, write_end = os.pipe()
        process = subprocess.Popen(command + ["--ready-fd", str(write_end)], stdout=log, stderr=log,
                                   pass_fds=[write_end])
        self.running.append(process)
        os.close(write_end)
        with os.fdopen(read_end) as pipe:
            line = pipe.readline() if select.select([pipe], [], [], 300)[0] else ""
        if not line.startswith("ready "):
            raise RuntimeError(f"{name} does not serve; see {log.name}")
        return process, int(line.split()[1])

    def log(self, name):
        with open(self.path(name), errors="replace") as file:
            return file.read()

    def end(self, process, seconds=20):
        """Its exit status after SIGTERM."""
        process.send_signal(signal.SIGTERM)
        return process.wait(seconds)

    def end_all(self):
        for process in self.running:
            if process.poll() is None:
                process.kill()
                process.wait()


def wait(seconds, wish, step=lambda: time.sleep(0.01)):
    """Whether the wish came true in time; `step` is what to do in between."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if wish():
            return True
        step()
    return wish()
