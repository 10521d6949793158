"""Random MJCF files: where joints stand and how they move, what bodies weigh, and what stands beside the arm.

How attitudes, units and classes are written is MuJoCo's own matter, whose compiler reads every file.
"""

import numpy as np

TIP = "tip"
MESH = '<mesh name="rock" vertex="0 0 0  .1 0 0  0 .12 0  0 0 .2  .1 .1 .1"/>'


def random_mjcf(rng: np.random.Generator) -> str:
    """The text of a file whose frame ``tip`` is at the end of an arm, of some joints in a random order."""
    return _File(rng).text()


class _File:
    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.names: list[str] = []
        self.endless: list[str] = []

    def text(self) -> str:
        cup = f'<body {self.place()}><freejoint/><geom size=".05" mass=".2"/></body>'
        mouse = f'<body name="mouse" mocap="true" {self.place()}><geom size=".02"/></body>'
        things = [cup, mouse, self.arm("l", 2, ""), self.arm("", 5, TIP)]
        self.rng.shuffle(things)
        flag = '<option><flag gravity="disable"/></option>' if self.chance(0.1) else ""
        rules = f'inertiafromgeom="{self.pick("auto", "true")}" balanceinertia="true" angle="radian"'
        rules += ' inertiagrouprange="0 2"' if self.chance(0.3) else ""
        return (
            f'<mujoco model="random"><compiler {rules}/>{flag}<asset>{MESH}</asset>'
            f"<worldbody>{''.join(things)}</worldbody>{self.equality()}{self.actuators()}</mujoco>"
        )

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def pick(self, *words: str) -> str:
        return str(self.rng.choice(words))

    def numbers(self, count: int, size: float = 1.0) -> str:
        return " ".join(f"{x:.17g}" for x in self.rng.uniform(-size, size, count))

    def place(self) -> str:
        return f'pos="{self.numbers(3, 0.4)}" quat="{self.numbers(4)}"'

    def mass(self) -> str:
        geoms = [
            f'<geom type="box" size=".05 .1 .15" {self.place()}/>',
            f'<geom type="mesh" mesh="rock" mass="{self.rng.uniform(0.2, 2.0):.17g}" {self.place()}/>',
            f'<geom type="mesh" mesh="rock" {self.place()} contype="0" conaffinity="0"/>',
            '<geom type="sphere" size=".08" group="4" mass=".3"/>',
        ]
        kept = geoms[:1] + [one for one in geoms[1:] if self.chance(0.4)]
        if self.chance(0.4):
            kept.append(f'<inertial mass="1.7" diaginertia=".02 .03 .04" {self.place()}/>')
        return "".join(kept)

    def joint(self, prefix: str) -> str:
        name, kind = f"{prefix}j{len(self.names)}", self.pick("range", "range", "none", "off")
        ends = np.sort(self.rng.uniform(-1.5, 1.5, 2)) + np.array([-0.2, 0.2])
        words = f'name="{name}" type="{self.pick("slide", "hinge", "hinge")}" pos="{self.numbers(3, 0.1)}"'
        words += f' axis="{self.numbers(3)}" ref="{self.pick("0", "0.3", "-0.7")}" armature="0.1"'
        words += "" if kind == "none" else f' range="{ends[0]:.17g} {ends[1]:.17g}"'
        words += ' limited="false"' if kind == "off" else ""
        self.names.append(name)
        if kind != "range" and not prefix:
            self.endless.append(name)
        return f"<joint {words}/>"

    def arm(self, prefix: str, count: int, tip: str) -> str:
        """Bodies with some joints each, with bodies and frames without joints between them."""
        inner = f'<frame {self.place()}><site name="{tip}" {self.place()}/></frame>' if tip else ""
        parts = []
        while count:
            here = min(count, int(self.rng.integers(1, 4)))
            count -= here
            parts.append("".join(self.joint(prefix) for _ in range(here)))
        for k, joints in enumerate(reversed(parts)):
            twin = tip if tip and k == 0 and self.chance(0.3) else f"{prefix}b{k}"
            inner = f'<body name="{twin}" {self.place()}>{joints}{self.mass()}{inner}</body>'
            if self.chance(0.4):
                inner = f'<body name="{prefix}f{k}" {self.place()}>{self.mass()}{inner}</body>'
            if self.chance(0.3):
                inner = f"<frame {self.place()}>{inner}</frame>"
        base = "<freejoint/>" if self.chance(0.2) else ""
        still = f'<body name="{prefix}plate" {self.place()}>{self.mass()}{inner}</body>'
        return f'<body name="{prefix}wall" {self.place()}>{base}{self.mass()}{still}</body>'

    def equality(self) -> str:
        if len(self.endless) < 2:
            return ""
        a, b, *more = self.rng.permutation(self.endless)
        chain = "".join(f'<joint joint1="{c}" joint2="{b}" polycoef="-.05 1.5 0 0 0"/>' for c in more[:1])
        return f'<equality><joint joint1="{b}" joint2="{a}" polycoef=".1 -.4 0 0 0"/>{chain}</equality>'

    def actuators(self) -> str:
        some = [name for name in self.names if self.chance(0.7)]
        motors = (f'<motor joint="{name}" gear="{self.pick("1", "-30")}" ctrlrange="-2 2"/>' for name in some)
        return f"<actuator>{''.join(motors)}</actuator>"
