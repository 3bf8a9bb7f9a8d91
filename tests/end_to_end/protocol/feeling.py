"""A master made from the page alone, and its hand: what the real farfeel-slave answers to poses, which the checks make up."""

import time

from support import Run, expect

from second import numbers as n
from second import session_object
from second.bulk_ends import BulkAtMaster
from second.master import Master
from second.sodium import public_key

_PATIENCE_S = 30.0  # with an answer: a busy machine may stand still now and then
_ABOVE_M, _LITTLE_ABOVE_M, _DEEP_M, _STEP_M = 0.012, 0.004, 0.003, 0.00005


class Feeling:
    """A session with the real slave: the scene, the poses that were told, and the answers to them."""

    def __init__(self, run: Run, scene, keys=None):
        """keys: of slave and master, where they have met already."""
        slave, secret = keys or run.two_keys()
        _, self.port = run.slave(scene)
        self.master = Master(self.port, secret, public_key(slave))
        self.bulk = BulkAtMaster(self.master)
        self.master.begin()
        expect(self.master.until(self.bulk.session_object), "no session object")
        self.object = session_object.read(self.bulk.session_object())
        self.scene, self.master.grid = self.object.scene, self.object.grid
        self.told = {}
        self.low = n.scaled(n.add(*self.scene.region), 0.5)

    def at_height(self, height_m):
        """Where To is when the working point is so high above the middle of the region."""
        return n.sub(n.sub(self.low, self.scene.working_point), n.scaled(self.scene.approach, height_m))

    def pose(self, p, seconds=0.0015, **more):
        pose = self.master.pose(p, **more)
        self.told[pose.number] = pose
        self.master.step(seconds)
        return pose

    def still(self, p, **more):
        """Says the pose until an answer to it is here: that answer."""
        first, had = self.pose(p, **more).number, len(self.master.answers)
        end = time.monotonic() + _PATIENCE_S
        while time.monotonic() < end:
            fresh = [a for a in self.master.answers[had:] if a.pose_number > first]
            if len(fresh) > 3:
                return fresh[-1]
            self.pose(p, **more)
        raise AssertionError("the slave does not answer")

    def lowered(self):
        """Lowers the tool from above the object into it."""
        steps = round((_ABOVE_M + _DEEP_M) / _STEP_M)
        for k in range(steps):
            self.pose(self.at_height(_ABOVE_M - k * _STEP_M))
        self.master.run(0.2)

    def force_at(self, p):
        """Of the contacts when the tool came down there from above, and stands [N]: more digits than the wrench has."""
        up = n.scaled(self.scene.approach, -1.0)
        for k in range(round(_LITTLE_ABOVE_M / _STEP_M), 0, -1):
            self.pose(n.add(p, n.scaled(up, k * _STEP_M)))
        for _ in range(60):  # let contacts fade in
            answer = self.still(p)
        push = (0.0, 0.0, 0.0)
        for contact in answer.contacts:
            push_N = contact.identity.stiffness * contact.share * max(0.0, contact.depth_m)
            push = n.sub(push, n.scaled(contact.translation_gradient(), push_N))
        return push

    def end(self):
        self.master.run(0.4)
        expect(not self.master.refused, len(self.master.refused), self.master.refused[:3])
        self.master.say_bye()
