"""Stalls of this machine, played: all processes below this one stand still together, again and again.

A busy machine keeps a virtual one from running for tenths of a second. SIGSTOP does the same to a test: none of its
threads runs, and the clocks go on. Two things differ from killing a process group. A test starts sessions and groups of
its own, so processes are found by their parents. And some tests stop a process themselves: it stays stopped.
"""
import ctypes
import os
import random
import signal
import threading
import time
from pathlib import Path

PR_SET_CHILD_SUBREAPER = 36
LONGEST_S = 0.3  # of a stall
STOPPING_S = 0.02  # how long a process may take to stand still: one that waits for the disk takes longer, and is left to it


def adopt_orphans():
    """Who outlives its parent becomes a child of this process, and so stays below it."""
    ctypes.CDLL(None, use_errno=True).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def reap_orphans(own):
    """Ends what is left of adopted processes; `own` is the child that somebody else waits for."""
    while True:
        try:
            ended = os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
        except ChildProcessError:
            return
        if ended is None or ended.si_pid == own:
            return
        os.waitpid(ended.si_pid, 0)


def state_and_parent(pid):
    """As the kernel has it, or nothing where the process is gone."""
    try:
        text = Path(f'/proc/{pid}/stat').read_text()
    except (FileNotFoundError, ProcessLookupError):
        return None
    state, parent = text[text.rindex(')') + 2:].split()[:2]
    return state, int(parent)


def processes_below(pid):
    """Parents before their children."""
    children = {}
    for entry in os.listdir('/proc'):
        if entry.isdigit():
            known = state_and_parent(entry)
            if known:
                children.setdefault(known[1], []).append(int(entry))
    found, at = [pid], 0
    while at < len(found):
        found += children.get(found[at], [])
        at += 1
    return found[1:]


def stop(pid):
    """Whether it was stopped by this call: one that stood still already is somebody else's."""
    known = state_and_parent(pid)
    if known is None or known[0] in 'TtZX':
        return False
    try:
        os.kill(pid, signal.SIGSTOP)
    except ProcessLookupError:
        return False
    until = time.monotonic() + STOPPING_S
    while time.monotonic() < until:
        known = state_and_parent(pid)
        if known is None or known[0] in 'TZX':
            break
        time.sleep(0.0005)
    return True


def stop_all_below(pid):
    """A parent stands still before its children are looked at: it stops none of them in between, and starts none."""
    stopped = []
    while True:
        more = [p for p in processes_below(pid) if p not in stopped and stop(p)]
        if not more:
            return stopped
        stopped += more


def go_on(stopped):
    for pid in reversed(stopped):
        try:
            os.kill(pid, signal.SIGCONT)
        except ProcessLookupError:
            pass


class Stalls:
    """While it lasts, all below the process `pid` stands still for up to LONGEST_S at random, every `every_s` or so."""

    def __init__(self, pid, seed, every_s):
        self.pid, self.random, self.every_s = pid, random.Random(seed), every_s
        self.count, self.stopped_s, self.longest_s = 0, 0.0, 0.0
        self.over = threading.Event()
        self.thread = threading.Thread(target=self.run)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        self.thread.join()

    def run(self):
        try:  # so that a stall does not last longer because this machine is busy elsewhere
            os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(60))
        except PermissionError:
            pass
        while not self.over.wait(self.random.expovariate(1 / self.every_s)):
            reap_orphans(self.pid)
            length_s = self.random.uniform(0, LONGEST_S)
            began = time.monotonic()
            stopped = stop_all_below(self.pid)
            try:
                self.over.wait(max(0.0, began + length_s - time.monotonic()))
            finally:
                go_on(stopped)
            if stopped:
                self.count += 1
                stood_s = time.monotonic() - began
                self.stopped_s += stood_s
                self.longest_s = max(self.longest_s, stood_s)
