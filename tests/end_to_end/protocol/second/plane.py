"""What the slave in Python answers with: one contact of the tool's working point with a plane, whatever the scene shows."""

from dataclasses import replace

from . import haptic
from . import numbers as n

STIFFNESS_N_PER_M = 800.0
_HOLDS_M = 0.01
_REACH_M = 0.003  # the contact is told from so far above the plane


class Plane:
    """The plane through `point`, with unit `normal` out of it, felt at `working_point` of the tool (in T)."""

    IDENTITY = haptic.Identity(id=7, object=0, stiffness=STIFFNESS_N_PER_M, damping=0.0, static_friction=0.0,
                               dynamic_friction=0.0)

    def __init__(self, point, normal, working_point):
        self.point, self.normal, self.working_point = point, normal, working_point
        self.touches, self.most_depth_m = 0, 0.0
        self.renamed_every, self._told = None, 0  # so many answers with a contact

    def depth_m(self, p_WT, R_WT):
        at = n.add(p_WT, n.rotate(R_WT, self.working_point))
        return -n.dot(n.sub(at, self.point), self.normal)

    def respond(self, pose):
        """The contacts and the wrench at a pose."""
        depth = self.depth_m(pose.p_WT, pose.R_WT)
        if depth < -_REACH_M:
            return [], (0.0,) * 6
        r = n.rotate(pose.R_WT, self.working_point)
        self._told += 1
        name = self._told // self.renamed_every if self.renamed_every else 0
        identity = replace(self.IDENTITY, id=self.IDENTITY.id + name)
        contact = haptic.Contact(name % haptic.PLACES, 0, r, depth, self.normal, (0.0,) * 3, (0.0,) * 3, _HOLDS_M,
                                 identity=identity)
        if pose.ahead_us is not None:
            contact.curvature = (0.0,) * 21
        force = n.scaled(self.normal, STIFFNESS_N_PER_M * max(depth, 0.0))
        self.touches += depth > 0
        self.most_depth_m = max(self.most_depth_m, depth)
        return [contact], n.cross(r, force) + force
