"""deploy/soak --stalls: the tests that a busy machine could make fail, while it is one.

Those with the label machine open sockets, or start threads or processes. They run as in deploy/test, and all of their
processes stand still together at random, for up to 0.3 s (tests/stalls/stalls.py says how). A test that fails then waits
for a time where it should wait for an event, or shows a fault in what it tests. Every test must pass 20 times in a row.
All of them, once, take some twelve minutes on two cores.

The last line is JSON; the exit code is 0 only if no test failed. What a test that failed had said is kept in
build/release/stalls.
"""
import argparse
import json
import os
import re
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import stalls

ROOT = Path(__file__).resolve().parent.parent.parent
BUILD = ROOT / 'build' / 'release'
KEPT = BUILD / 'stalls'


def arguments():
    parser = argparse.ArgumentParser(prog='deploy/soak --stalls', description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--times', type=int, default=20, metavar='N', help='how often each test runs; 20 unless told')
    parser.add_argument('--seconds', type=float, metavar='N', help='instead: as often as fits, once at least')
    parser.add_argument('-R', dest='regex', metavar='REGEX', help='only the tests whose names match, as ctest has it')
    parser.add_argument('--every', type=float, default=0.5, metavar='S',
                        help='from one stall to the next, on average [s]; 0.5 unless told')
    parser.add_argument('--seed', type=int, metavar='N', help='of the stalls; the time of day unless told')
    parser.add_argument('--built', action='store_true', help='the test programs are built already')
    return parser.parse_args()


def build():
    for command in (['cmake', '--preset', 'release'],
                    ['cmake', '--build', '--preset', 'release', '--target', 'machine_tests']):
        if subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL, check=False).returncode != 0:
            sys.exit('deploy/soak: the build failed: deploy/test says why')


def exactly(names):
    return '^(' + '|'.join(re.escape(name) for name in names) + ')$'


class Soak:
    def __init__(self, options):
        self.options = options
        self.seed = int(time.time()) if options.seed is None else options.seed
        self.passed, self.skipped, self.failed = {}, set(), {}
        self.stall_count, self.stopped_s, self.longest_s = 0, 0.0, 0.0

    def round(self, number):
        """Each test once; those that failed before are left out."""
        junit = KEPT / 'round.xml'
        junit.unlink(missing_ok=True)
        command = ['ctest', '--test-dir', str(BUILD), '-L', '^machine$', '-j', str(os.cpu_count()),
                   '--output-junit', str(junit)]
        if self.options.regex:
            command += ['-R', self.options.regex]
        if self.failed:
            command += ['-E', exactly(self.failed)]
        with open(KEPT / 'round.log', 'w', encoding='utf-8') as log, \
                subprocess.Popen(command, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=log, stderr=log) as ctest, \
                stalls.Stalls(ctest.pid, self.seed + number, self.options.every) as machine:
            try:
                ctest.wait()
            except BaseException:
                ctest.terminate()
                raise
        self.stall_count += machine.count
        self.stopped_s += machine.stopped_s
        self.longest_s = max(self.longest_s, machine.longest_s)
        return self.take(junit, number)

    def take(self, junit, number):
        """How many tests ran."""
        if not junit.exists():
            sys.exit(f'deploy/soak: ctest did not run: {(KEPT / "round.log").read_text()}')
        ran = 0
        for case in ElementTree.parse(junit).getroot().iter('testcase'):
            name, status = case.get('name'), case.get('status')
            ran += status != 'notrun'
            if status == 'run':
                self.passed[name] = self.passed.get(name, 0) + 1
            elif status == 'fail':
                self.failed[name] = self.passed.pop(name, 0)
                kept = KEPT / (re.sub(r'[^A-Za-z0-9._-]', '_', name) + '.txt')
                kept.write_text(case.findtext('system-out') or '', encoding='utf-8')
                print(f'FAILED  {name}, after {self.failed[name]} runs that passed: {kept.relative_to(ROOT)}')
            else:
                self.skipped.add(name)
        if ran > 0:
            print(f'round {number + 1}: {ran} ran, {len(self.failed)} have failed so far', flush=True)
        return ran

    def run(self):
        began, number = time.monotonic(), 0
        while self.round(number) > 0:
            number += 1
            if self.options.seconds is None and number >= self.options.times:
                break
            if self.options.seconds is not None and time.monotonic() - began > self.options.seconds:
                break
        line = {'tests': len(self.passed) + len(self.failed),
                'runs': sum(self.passed.values()) + sum(self.failed.values()) + len(self.failed),
                'failed': sorted(self.failed), 'skipped': len(self.skipped), 'rounds': number,
                'stalls': self.stall_count, 'stopped_s': round(self.stopped_s, 1),
                'longest_stall_s': round(self.longest_s, 2), 'seed': self.seed}
        print(json.dumps(line))
        return 1 if self.failed or not self.passed else 0


def main():
    options = arguments()
    if not options.built:
        build()
    KEPT.mkdir(parents=True, exist_ok=True)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that nothing is left standing still
    stalls.adopt_orphans()
    return Soak(options).run()


if __name__ == '__main__':
    sys.exit(main())
