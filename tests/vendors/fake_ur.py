"""A controller of Universal Robots on loopback, as far as RTDE (port 30004) and the dashboard (29999) go.

``python fake_ur.py 1.0`` says "ready" and serves until its input ends; 1.0 is how long a protective stop is
locked [s]. Lines to the dashboard that begin with "fake" change its state: ``fake protective_stop``, ``fake
joint_fault 2``. It runs in a process of its own: ur_rtde keeps the interpreter's lock while it connects. What
it answers to unknown calls is a guess.
"""

import contextlib
import socket
import struct
import sys
import threading
import time

VECTORS = {
    "actual_q", "actual_qd", "target_q", "target_qd", "target_qdd", "target_current", "target_moment",
    "actual_current", "joint_control_output", "joint_temperatures", "actual_joint_voltage", "actual_TCP_pose",
    "actual_TCP_speed", "actual_TCP_force", "target_TCP_pose", "target_TCP_speed", "ft_raw_wrench",
    "payload_inertia",
}  # fmt: skip
WHOLE = {
    "robot_mode": "INT32", "safety_mode": "INT32", "safety_status": "INT32", "safety_status_bits": "UINT32",
    "robot_status_bits": "UINT32", "runtime_state": "UINT32", "joint_mode": "VECTOR6INT32",
    "actual_tool_accelerometer": "VECTOR3D", "payload_cog": "VECTOR3D", "actual_digital_input_bits": "UINT64",
    "actual_digital_output_bits": "UINT64",
}  # fmt: skip
FORMS = {
    "DOUBLE": "d", "INT32": "i", "UINT32": "I", "UINT64": "Q", "BOOL": "?", "VECTOR6D": "6d",
    "VECTOR3D": "3d", "VECTOR6INT32": "6i",
}  # fmt: skip
NORMAL, PROTECTIVE_STOP, FAULT = 1, 3, 9
BITS = {NORMAL: 1, PROTECTIVE_STOP: 1 << 2 | 1 << 10, FAULT: 1 << 9 | 1 << 10}
POWER_OFF, IDLE, RUNNING = 3, 5, 7
JOINT_OFF, JOINT_FAULT, JOINT_RUNNING, JOINT_IDLE = 239, 252, 253, 255


def type_of(name):
    """The type that the controller declares for a field."""
    if name in VECTORS:
        return "VECTOR6D"
    kinds = {"int_register": "INT32", "bit_register": "BOOL"}
    return WHOLE.get(name) or next((kind for word, kind in kinds.items() if word in name), "DOUBLE")


class FakeUR:
    """The state of the controller, and a thread for each client."""

    def __init__(self, locked_for):
        self.q, self.joints = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0], [JOINT_RUNNING] * 6
        self.robot, self.safety, self.since, self.locked_for = RUNNING, NORMAL, 0.0, locked_for
        for port, speak in ((30004, self.rtde), (29999, self.dashboard)):
            server = socket.create_server(("127.0.0.1", port))
            threading.Thread(target=self.accept, args=(server, speak), daemon=True).start()

    def value(self, name):
        """A field as it is sent."""
        here = {
            "timestamp": time.monotonic(), "robot_mode": self.robot, "safety_mode": self.safety,
            "safety_status": self.safety, "safety_status_bits": BITS[self.safety],
            "robot_status_bits": 3, "runtime_state": 2, "joint_mode": self.joints, "actual_q": self.q,
            "target_q": self.q, "speed_scaling": 1.0, "target_speed_fraction": 1.0,
        }.get(name)  # fmt: skip
        form = FORMS[type_of(name)]
        if here is None:
            here = [0] * int(form[0]) if form[0].isdigit() else 0
        return struct.pack(">" + form, *(here if isinstance(here, list) else [here]))

    def accept(self, server, speak):
        while True:
            threading.Thread(target=self.guarded, args=(speak, server.accept()[0]), daemon=True).start()

    @staticmethod
    def guarded(speak, peer):
        with contextlib.suppress(OSError):  # the client has gone
            speak(peer)

    def rtde(self, peer):
        """Packages of length, type and payload; a recipe names the fields of a data package."""
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        fields, going, rest = [], threading.Event(), b""

        def send(kind, payload):
            peer.sendall(struct.pack(">HB", 3 + len(payload), ord(kind)) + payload)

        def stream():
            while going.is_set():
                send("U", b"\x01" + b"".join(map(self.value, fields)))
                time.sleep(0.008)

        while more := peer.recv(4096):
            rest += more
            while len(rest) >= 3 and len(rest) >= (size := struct.unpack(">H", rest[:2])[0]):
                kind, payload, rest = chr(rest[2]), rest[3:size], rest[size:]
                if kind == "V":
                    send("V", bytes([struct.unpack(">H", payload)[0] == 2]))
                elif kind == "v":
                    send("v", struct.pack(">4I", 5, 16, 0, 0))
                elif kind in "OI":
                    names = (payload[8:] if kind == "O" else payload).decode().strip(",").split(",")
                    fields = names if kind == "O" else fields
                    send(kind, b"\x01" + ",".join(map(type_of, names)).encode())
                elif kind in "SP":
                    send(kind, b"\x01")
                    (going.set if kind == "S" else going.clear)()
                    if kind == "S":
                        threading.Thread(
                            target=self.guarded, args=(lambda _: stream(), peer), daemon=True
                        ).start()
        going.clear()

    def dashboard(self, peer):
        peer.sendall(b"Connected: Universal Robots Dashboard Server\n")
        for line in peer.makefile("r"):
            peer.sendall((self.answer(line.strip()) + "\n").encode())

    def answer(self, asked):
        """What the dashboard says."""
        if asked == "fake protective_stop":
            self.safety, self.since = PROTECTIVE_STOP, time.monotonic()
        elif asked.startswith("fake joint_fault"):
            self.joints = [JOINT_FAULT if k == int(asked.split()[-1]) else JOINT_OFF for k in range(6)]
            self.safety, self.robot = FAULT, POWER_OFF
        elif asked == "unlock protective stop":
            if time.monotonic() - self.since < self.locked_for:
                return "Cannot unlock protective stop until 5s after occurrence"
            self.safety = NORMAL
            return "Protective stop releasing"
        elif asked == "restart safety":
            self.safety, self.robot, self.joints = NORMAL, POWER_OFF, [JOINT_OFF] * 6
            return "Restarting safety"
        elif asked == "power on":
            self.robot, self.joints = IDLE, [JOINT_IDLE] * 6
            return "Powering on"
        elif asked == "brake release":
            self.robot, self.joints = RUNNING, [JOINT_RUNNING] * 6
            return "Brake releasing"
        said = {"PolyscopeVersion": "URSoftware 5.16.0.1", "close safety popup": "closing safety popup"}
        return said.get(asked, "done" if asked.startswith("fake") else f"could not understand: {asked}")


if __name__ == "__main__":
    FakeUR(*map(float, sys.argv[1:2]))
    print("ready", flush=True)
    sys.stdin.read()
