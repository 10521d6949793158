"""A torque arm that works, with rotors and a load that nobody told of, was shaken and called a runaway.

Found by ``ftqp campaign detection`` with torque drives alone.
"""

from ftqp.app.campaign.judged_scenario import broken_laws

SCENARIO = """
path = {{ kind = "circle", duration = {duration}, radius = {radius} }}
robot = {{ name = "panda" }}
start = {{ q = {q} }}
sensors = {{ position_noise = 0.0001, latency = {latency} }}

[planner]
dt = 0.001
noise = {{ q = 0.0001 }}
task = {{ rows = "position" }}
detector = {{}}
drive = "torque"

[simulation]
plant = "mujoco"
seed = {seed}

[simulation.mujoco]
payload = {{ mass = {mass}, com = [0.0, 0.0, 0.05] }}
rotors = {rotors}
mass_scale = {scale}
coulomb = {coulomb}
viscous = {viscous}
jitter = {jitter}
"""


DRAWN = {
    "duration": 5.998724053573279,
    "radius": 0.040650697213422196,
    "q": [0.3989887, -0.7138474, -0.1177614, -2.1071613, -0.0878451, 1.6162512, 0.3595637],
    "latency": 1,
    "seed": 766988557,
    "mass": 2.29397898,
    "rotors": 0.13286447,
    "scale": 1.08485762,
    "coulomb": 0.45317333,
    "viscous": 0.55222259,
    "jitter": 0.49164943,
}


def test_wrist_that_falls_under_a_load_and_comes_back_is_no_runaway_and_does_not_chatter():
    assert broken_laws(SCENARIO.format(**DRAWN), judged="in physics") == {}
