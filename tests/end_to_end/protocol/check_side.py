#!/usr/bin/env python3
"""Side sessions of the real farfeel-slave, by a client made from the page alone: edits made once, news, courses, the
scene as files, rights."""

import sys
import time
import tomllib

from support import Run, expect, expect_raises, main

from second import control, saved_scene
from second import datagrams as d
from second.bulk_ends import BulkAtMaster
from second.lane import Counter
from second.master import Refusal
from second.objects import hash_of
from second.side import Side
from second.sodium import public_key


_OFFERED, _LATER = 1, 2


class _Client:
    def __init__(self, run: Run, role="operate,edit", more=("--editable",)):
        self.slave_secret, self.secret = run.two_keys(role=role)
        _, self.port = run.slave("living", *more)
        self.counter = Counter()
        self.again()

    def again(self):
        self.side = Side(self.port, self.secret, public_key(self.slave_secret), self.counter)
        self.bulk = BulkAtMaster(self.side)
        self.answers, self.news, self.saves = [], [], []
        self.side.on_bulk[control.EDIT_ANSWER] = lambda message: self.answers.append(control.EditAnswer.read(message))
        self.side.on_bulk[control.SAVE_ANSWER] = lambda message: self.saves.append(control.SaveAnswer.read(message))
        self.side.on_bulk[control.SCENE_NEWS] = lambda message: self.news.append(control.read_scene_news(message))

    def ask(self, request, times=1):
        before = len(self.answers)
        for _ in range(times):
            self.side.send(d.BULK, control.EDIT_REQUEST, request.write())
        expect(self.side.until(lambda: len(self.answers) >= before + times), "no answer")
        return self.answers[before:]


    def saved(self, number):
        """The answer to a request for the scene, and its files."""
        def is_answered():
            return any(a.number == number and a.outcome != _LATER for a in self.saves)

        for _ in range(60):  # a scene that was saved a moment ago and has changed is saved again later
            self.side.send(d.BULK, control.SAVE_REQUEST, control.write_save_request(number))
            if self.side.run(0.5, is_answered):
                break
        expect(is_answered(), "no answer", self.saves)
        answer = [a for a in self.saves if a.number == number][-1]
        expect(answer.outcome == _OFFERED, answer)
        objects = self.bulk.objects.delivered
        expect(self.side.until(lambda: saved_scene.SLOT in objects and hash_of(objects[saved_scene.SLOT]) == answer.hash),
               "it does not come")
        return answer, saved_scene.read(objects[saved_scene.SLOT])


def gives_its_scene_as_files(run):
    client = _Client(run)
    client.side.begin()
    answer, files = client.saved(1)
    expect(answer.version == 0, answer)
    scene = tomllib.loads(files["scene.toml"].decode())
    expect([o["name"] for o in scene["object"]] == ["block", "visitor"] and not scene["object"][1]["present"], scene)
    expect("timeline" not in scene and scene["editable"] is True, scene)
    named = {scene["tool"]["asset"], *(o["asset"] for o in scene["object"])}
    expect(named == set(files) - {"scene.toml"} and len(named) == 3, named, sorted(files))
    for name in named:
        expect(files[name][:4] == b"glTF" and int.from_bytes(files[name][8:12], "little") == len(files[name]), name)
    again, _ = client.saved(2)
    expect(again.hash == answer.hash, "the same scene in other bytes", again, answer)
    client.ask(control.EditRequest(7, control.STAMP, "block", (0.0, 0.0, 0.02), 0.012, 0.0003))
    client.ask(control.EditRequest(8, control.SPAWN, "visitor", pose=(0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)))
    after, changed = client.saved(3)
    expect(after.version == 2 and {n for n in changed if changed[n] != files[n]} == {"scene.toml", scene["object"][0]["asset"]},
           after, [n for n in changed if changed[n] != files[n]])
    there = tomllib.loads(changed["scene.toml"].decode())["object"][1]
    expect(there.get("present", True) and there["position_m"] == [0.1, 0, 0], there)
    expect(client.side.refused == [], client.side.refused[:3])
    client.side.say_bye()


def edits_once(run):
    client = _Client(run)
    client.side.begin()
    stamp = control.EditRequest(7, control.STAMP, "block", (0.0, 0.0, 0.02), 0.012, 0.0003)
    answers = client.ask(stamp, times=3)
    expect(all(a.is_done and a.version == 1 and a.number == 7 for a in answers), answers)
    expect(client.side.until(lambda: any(version == 1 and "stamped" in words for version, words in client.news)), client.news)
    # Another process of the same key asks again, as after a crash: it is one edit still.
    client.side.say_bye()
    client.again()
    client.side.begin()
    again, = client.ask(stamp)
    expect(again == answers[0], again)
    other, = client.ask(control.EditRequest(8, control.SPAWN, "visitor", pose=(0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)))
    expect(other.is_done and other.version == 2, other)
    refused, = client.ask(control.EditRequest(9, control.SPAWN, "visitor"))
    expect(not refused.is_done and refused.version == 2 and "there already" in refused.words, refused)
    expect(client.side.refused == [], client.side.refused[:3])
    client.side.say_bye()


def tells_who_came_late(run):
    client = _Client(run)
    client.side.begin()
    client.ask(control.EditRequest(1, control.SPAWN, "visitor", pose=(0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)))
    client.side.say_bye()
    client.again()
    client.side.begin()
    courses = client.bulk.courses
    expect(client.side.until(lambda: courses), "no course")
    expect(courses[0].object == 1 and courses[0].is_there, courses)
    expect(client.side.until(lambda: client.news and client.news[0][0] == 1), client.news)
    client.side.say_bye()


def keeps_to_roles(run):
    client = _Client(run, role="operate")
    verdict = expect_raises(Refusal, client.side.begin)
    expect(verdict.args == (d.NOT_ALLOWED,), verdict)
    word = run.programs.key("master", "show", "--key-only").strip()
    run.programs.key("slave", "trust", "operator", "anna", word, "--role", "watch")
    client.again()

    def is_in():
        try:
            client.side.begin()
            return True
        except Refusal:
            return False

    end = time.monotonic() + 30  # the slave looks at its list four times a second
    while not is_in():
        expect(time.monotonic() < end, "who may watch does not get in")
        time.sleep(0.1)
    client.saved(1)
    client.side.send(d.BULK, control.EDIT_REQUEST, control.EditRequest(1, control.REMOVE, "block").write())
    expect(client.side.until(lambda: len(client.news) >= 4), "no news")
    expect(not client.answers and all(version == 0 for version, _ in client.news), "who may watch alone edits", client.news)
    client.side.say_bye()


if __name__ == "__main__":
    sys.exit(main([edits_once, gives_its_scene_as_files, tells_who_came_late, keeps_to_roles]))
