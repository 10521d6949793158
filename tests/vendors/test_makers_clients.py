"""The tables beside the makers' own clients, on simulated servos behind a pseudo terminal."""

import pytest
from tests.going import PANDA, started
from tests.vendors.fake_servos import FakeServo
from tests.vendors.serial_line import SerialLine

import ftqp

pytest.importorskip("serial", reason='needs the extra "dev": pip install -e ".[dev]"')
CLIENTS = {"dynamixel": ("dynamixel_sdk", 2.0, 57600), "feetech": ("scservo_sdk", 0, 1_000_000)}
WORDS = {"dynamixel": "hardware_error", "feetech": "status"}
IDS = range(1, 8)


class Client:
    """Reads the whole block of a servo by a maker's SDK, as ``Table.decode`` says it should be done."""

    def __init__(self, kind, line):
        module, protocol, baud = CLIENTS[kind]
        self.sdk = pytest.importorskip(module, reason='needs the extra "dev": pip install -e ".[dev]"')
        self.table, self.misses = ftqp.vendors.table(kind), 0
        self.port, self.packets = self.sdk.PortHandler(line.port), self.sdk.PacketHandler(protocol)
        assert self.port.openPort() and self.port.setBaudRate(baud)

    def ask(self, number, *, empty=True):
        """What a servo says, or None where no whole answer came."""
        block = self.table.block
        if empty:
            self.port.ser.reset_input_buffer()
        data, result, _ = self.packets.readTxRx(self.port, number, block["address"], block["length"])
        if result != self.sdk.COMM_SUCCESS:
            self.misses += 1
            return None
        return self.table.decode(bytes(data))

    def answer(self, number, **how):
        """What a servo says in the end; a miss is asked for anew."""
        while (one := self.ask(number, **how)) is None:
            pass
        return one

    def tell(self, say, *words):
        """Say something to a servo until it has answered."""
        while say(self.port, *words)[0] != self.sdk.COMM_SUCCESS:
            self.port.ser.reset_input_buffer()

    def sample(self):
        """A whole sample: the words, and the positions [steps]."""
        told = [self.answer(number) for number in IDS]
        word = WORDS[self.table.name]
        return {word: [one[word] for one in told]}, [one["position"] for one in told]


@pytest.fixture(params=sorted(CLIENTS))
def client(request):
    servos = {number: FakeServo(request.param, 0.1 * number) for number in IDS}
    line = SerialLine(request.param, servos)
    made = Client(request.param, line)
    made.line, made.servos = line, servos
    yield made
    made.port.closePort()
    line.close()


@pytest.mark.long
def test_status_and_position_of_each_servo_come_from_one_answer(client):
    words, places = client.sample()
    assert list(words.values()) == [[0] * 7]
    assert places == [servo.at("position") for servo in client.servos.values()]


def missed_once(client):
    """A servo answers after its time, and moves; its late answer lies in the input."""
    client.line.late = 1
    assert client.ask(3) is None
    client.line.release()
    while not client.port.ser.in_waiting:
        pass
    client.servos[3].put("position", 1111)


@pytest.mark.long
def test_a_late_answer_is_not_taken_for_that_of_the_next_question(client):
    missed_once(client)
    assert client.answer(3)["position"] == 1111 and client.misses >= 1
    assert client.sample()[1][2] == 1111


@pytest.mark.long
def test_without_emptying_the_input_feetechs_client_takes_it_for_that(client):
    """Why the input is emptied: `clearPort`, which the client calls before it asks, empties the output."""
    missed_once(client)
    if client.table.name == "feetech":
        assert client.answer(3, empty=False)["position"] != 1111


@pytest.mark.long
def test_a_servo_that_gives_up_is_reported_and_comes_back_by_its_steps(client):
    planner = started(PANDA, dt=0.01, task=ftqp.Task("position"))
    watch, servo = ftqp.vendors.Watch(planner, client.table), client.servos[4]
    servo.jammed = True
    servo.put("goal", servo.at("position") + 200)
    for _ in range(60):
        servo.live(0.01)
    for _ in range(2):
        watch.look(client.sample()[0], PANDA.neutral)
    assert set(planner.faults) == {PANDA.joints[3]}
    servo.jammed = False
    wide, torque, goal = (4, 64, 116) if client.table.name == "dynamixel" else (2, 40, 42)
    write = {2: client.packets.write2ByteTxRx, 4: client.packets.write4ByteTxRx}[wide]
    recovery = watch.recover(PANDA.joints[3])
    while (step := recovery.next) is not None:
        if step.do == "reboot":
            client.tell(client.packets.reboot, 4)
        elif step.do in ("torque off", "torque on"):
            client.tell(client.packets.write1ByteTxRx, 4, torque, int(step.do == "torque on"))
        elif step.do == "goal := present":
            client.tell(write, 4, goal, client.answer(4)["position"])
        elif step.do == "withdraw":
            watch.withdraw(PANDA.joints[3])
        recovery.done("program")
    assert servo.at("torque") and not servo.at("status") and not any(servo.switched_on_far)
    for _ in range(3):
        watch.look(client.sample()[0], PANDA.neutral)
    assert not planner.faults and watch.standing == ()
