"""Simulated servos behind a pseudo terminal, which makers' clients open as a port."""

import os
import select
import threading
import tty

HEADS = {"feetech": b"\xff\xff", "dynamixel": b"\xff\xff\xfd\x00"}
PING, READ, WRITE, REBOOT, SYNC_READ, SYNC_WRITE = 1, 2, 3, 8, 0x82, 0x83
ALERT = 0x80
"""A Dynamixel sets this bit in every answer while its hardware error is not 0."""


def check_of(body):
    """Of Dynamixel's protocol 2: polynomial 0x8005, from 0."""
    value = 0
    for byte in body:
        value ^= byte << 8
        for _ in range(8):
            value = (value << 1 ^ 0x8005 if value & 0x8000 else value << 1) & 0xFFFF
    return value


class SerialLine:
    """Serves servos by their numbers until it is closed; ``port`` is the name of the line.

    Attributes:
        silent: Numbers of servos that do not answer.
        late: So many answers are held back until ``release``, as on a busy machine.
    """

    def __init__(self, kind, servos):
        self.kind, self.servos, self.silent, self.late = kind, servos, set(), 0
        self.wide = 1 if kind == "feetech" else 2  # bytes of an address and of a length
        self.hand, self.line = os.openpty()
        tty.setraw(self.hand), tty.setraw(self.line)
        self.port, self.held, self.open = os.ttyname(self.line), b"", True
        self.thread = threading.Thread(target=self._serve)
        self.thread.start()

    def close(self):
        self.open = False
        self.thread.join()
        os.close(self.hand), os.close(self.line)

    def _serve(self):
        rest = b""
        while self.open:
            if select.select([self.hand], [], [], 0.02)[0]:
                rest += os.read(self.hand, 4096)
                while (found := self._first(rest)) is not None:
                    number, word, data, rest = found
                    self._do(number, word, data)

    def _first(self, text):
        """The first whole instruction: to whom, which, its parameters, and what comes after it."""
        head, at, size, check = (HEADS[self.kind], 3, 1, 1) if self.wide == 1 else (HEADS[self.kind], 5, 2, 2)
        start = text.find(head)
        begin = start + at + size
        if start < 0 or len(text) < begin:
            return None
        end = begin + int.from_bytes(text[start + at : begin], "little")
        if len(text) < end:
            return None
        return text[start + at - 1], text[begin], text[begin + 1 : end - check], text[end:]

    def _do(self, number, word, data):
        place, size = (int.from_bytes(data[k : k + self.wide], "little") for k in (0, self.wide))
        rest = data[2 * self.wide :]
        if word == SYNC_READ:
            for one in filter(self.servos.__contains__, rest):
                self._say(one, self.servos[one].answer(place, size))
        elif word == SYNC_WRITE:
            for k in range(0, len(rest), size + 1):
                self._write(rest[k], place, rest[k + 1 : k + 1 + size])
        elif number in self.servos:
            servo = self.servos[number]
            if word == WRITE:
                self._write(number, place, data[self.wide :])
            elif word == REBOOT:
                servo.reboot()
            self._say(number, servo.answer(place, size) if word == READ else b"")

    def _write(self, number, place, data):
        servo = self.servos[number]
        torque = {"feetech": 40, "dynamixel": 64}[self.kind]
        if place == torque:
            servo.switch_on() if data[0] else servo.put("torque", 0)
        else:
            servo.memory[place : place + len(data)] = data

    def _say(self, number, data):
        status = self.servos[number].at("status")
        if self.kind == "feetech":
            body = bytes([number, len(data) + 2, status]) + data
            text = HEADS["feetech"] + body + bytes([~sum(body) & 0xFF])
        else:
            size = (len(data) + 4).to_bytes(2, "little")
            body = (
                HEADS["dynamixel"] + bytes([number]) + size + b"\x55" + bytes([ALERT * bool(status)]) + data
            )
            text = body + check_of(body).to_bytes(2, "little")
        if number in self.silent:
            return
        if self.late:
            self.late, self.held = self.late - 1, self.held + text
            return
        os.write(self.hand, text)

    def release(self):
        """Let the answers come that were held back."""
        os.write(self.hand, self.held)
        self.held = b""
