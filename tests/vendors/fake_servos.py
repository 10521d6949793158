"""Registers of servos that move, jam, give up and grow hot, in time that the test advances."""

import numpy as np

OVERLOAD, HOT = 0x20, 0x04
PATIENCE = 0.3
"""A jammed servo gives up after so long [s]."""
SPEED = 6.0
"""How fast a servo turns [rad/s]."""
STEP = 2.0 * np.pi / 4096
PLACES = {
    "feetech": {"torque": (40, 1), "goal": (42, 2), "position": (56, 2), "load": (60, 2),
                "temperature": (63, 1), "status": (65, 1)},
    "dynamixel": {"torque": (64, 1), "status": (70, 1), "goal": (116, 4), "position": (132, 4),
                  "temperature": (146, 1)},
}  # fmt: skip


class FakeServo:
    """One servo: its memory, and what happens to it."""

    def __init__(self, kind, at=0.0):
        self.kind, self.memory, self.jammed, self.strained = kind, bytearray(256), False, 0.0
        self.switched_on_far, self.reboots = [], 0
        self.place = at  # where it is [rad]
        for name, value in (("temperature", 35), ("goal", steps(at)), ("position", steps(at)), ("torque", 1)):
            self.put(name, value)

    def at(self, name):
        place, size = PLACES[self.kind][name]
        return int.from_bytes(self.memory[place : place + size], "little")

    def put(self, name, value):
        if name in PLACES[self.kind]:
            place, size = PLACES[self.kind][name]
            self.memory[place : place + size] = int(value).to_bytes(size, "little")

    def answer(self, place, size):
        """A read: so many bytes."""
        return bytes(self.memory[place : place + size])

    def switch_on(self):
        """Torque on; a Dynamixel that is shut down refuses, a Feetech leaves its overload so (assumed)."""
        self.switched_on_far.append(abs(self.at("goal") - self.at("position")) > 1)
        if self.kind == "dynamixel" and self.at("status"):
            return
        if not self.jammed:
            self.put("status", self.at("status") & ~OVERLOAD)
        self.put("torque", 1)

    def reboot(self):
        self.reboots += 1
        for name, value in (("status", 0), ("torque", 0)):
            self.put(name, value)

    def live(self, dt):
        """It moves, or strains and gives up."""
        away = self.at("goal") - self.at("position")
        works = self.at("torque") and not self.at("status")
        self.strained = self.strained + dt if works and self.jammed and abs(away) > 20 else 0.0
        if self.strained > PATIENCE:
            self.put("status", self.at("status") | OVERLOAD)
        if self.at("temperature") > 70:
            self.put("status", self.at("status") | HOT)
        if self.kind == "dynamixel" and self.at("status"):
            self.put("torque", 0)
        if works and not self.jammed:
            goal = (self.at("goal") - 2048) * STEP
            self.place += float(np.clip(goal - self.place, -SPEED * dt, SPEED * dt))
            self.put("position", steps(self.place))


def steps(angle):
    """The number that a servo has for an angle [rad]."""
    return round(angle / STEP) + 2048


def angle_of(number):
    """The angle of a servo's number [rad]."""
    return (number - 2048) * STEP


class FakeServos:
    """Servos on one line, each read in one block, as ``ftqp.vendors.table(kind).block`` says."""

    def __init__(self, table, q):
        self.table, self.servos = table, [FakeServo(table.name, at) for at in q]

    def read(self):
        """Status by the table's word, and positions [rad], each servo's from one answer."""
        block = self.table.block
        told = [self.table.decode(servo.answer(block["address"], block["length"])) for servo in self.servos]
        (word,) = self.table.words
        return {word: [one[word] for one in told]}, np.array([angle_of(one["position"]) for one in told])

    def write(self, q, dt):
        """Goals for all, and what they do for so long."""
        for servo, goal in zip(self.servos, q, strict=True):
            servo.put("goal", steps(goal))
            servo.live(dt)
