"""Random MJCF files with all that public ones do to where an arm stands, how it moves and what it weighs."""

from itertools import permutations

import numpy as np

TIP = "tip"
MESH = '<mesh name="rock" vertex="0 0 0  .1 0 0  0 .12 0  0 0 .2  .1 .1 .1"/>'


def random_mjcf(rng: np.random.Generator) -> str:
    """The text of a file whose frame ``tip`` is at the end of an arm, of some joints in a random order."""
    return _File(rng).text()


class _File:
    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.degrees = bool(rng.random() < 0.5)
        self.names: list[str] = []
        self.endless: list[str] = []

    def text(self) -> str:
        things = [
            self.table(),
            self.cup(),
            self.hand_of_a_mouse(),
            self.arm("l", 2, ""),
            self.arm("", 5, TIP),
        ]
        self.rng.shuffle(things)
        return (
            f'<mujoco model="random">{self.compiler()}{self.option()}<asset>{MESH}</asset>'
            f"{self.default()}<worldbody>{''.join(things)}</worldbody>{self.equality()}{self.actuators()}"
            "</mujoco>"
        )

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def pick(self, *words: str) -> str:
        return str(self.rng.choice(words))

    def numbers(self, count: int, size: float = 1.0) -> str:
        return " ".join(f"{x:.17g}" for x in self.rng.uniform(-size, size, count))

    def angle(self, radian: float) -> float:
        return float(np.degrees(radian)) if self.degrees else radian

    def compiler(self) -> str:
        sequence = self.pick(*("".join(p) for p in permutations("xyz")), "xyx", "zxz")
        words = {
            "angle": "degree" if self.degrees else "radian",
            "eulerseq": "".join(c.upper() if self.chance(0.5) else c for c in sequence),
            "inertiafromgeom": self.pick("auto", "auto", "true"),
            "balanceinertia": self.pick("true", "false"),
            "fusestatic": self.pick("true", "false"),
        }
        if self.chance(0.3):
            words |= {"boundmass": "0.8", "boundinertia": "0.002"}
        if self.chance(0.3):
            words["inertiagrouprange"] = "0 2"
        return "<compiler " + " ".join(f'{k}="{v}"' for k, v in words.items()) + "/>"

    def option(self) -> str:
        flag = '<flag gravity="disable"/>' if self.chance(0.1) else ""
        given = f' gravity="{self.numbers(3, 10.0)}"' if self.chance(0.5) else ""
        return f"<option{given}>{flag}</option>"

    def default(self) -> str:
        return (
            '<default><joint armature="0.1" damping="0.3"/><geom density="700"/><default class="odd">'
            '<joint ref="0.4" axis="1 2 -1" frictionloss="0.2"/>'
            '<geom density="1200" contype="0" conaffinity="0" group="2"/></default></default>'
        )

    def place(self) -> str:
        """Where a body or frame stands, its attitude written in one of MJCF's ways."""
        turn = {
            "quat": self.numbers(4),
            "euler": " ".join(f"{self.angle(float(a)):.17g}" for a in self.rng.uniform(-2.0, 2.0, 3)),
            "axisangle": f"{self.numbers(3)} {self.angle(1.1):.17g}",
            "xyaxes": self.numbers(6),
            "zaxis": self.numbers(3),
        }
        way = self.pick("", *turn)
        return f'pos="{self.numbers(3, 0.4)}"' + (f' {way}="{turn[way]}"' if way else "")

    def mass(self) -> str:
        geoms = [
            f'<geom type="box" size=".05 .1 .15" {self.place()}/>',
            f'<geom class="odd" type="capsule" size=".05 .1" mass="{self.rng.uniform(0.2, 2.0):.17g}"/>',
            f'<geom type="mesh" mesh="rock" mass="{self.rng.uniform(0.2, 2.0):.17g}" {self.place()}/>',
            f'<geom type="mesh" mesh="rock" {self.place()} contype="0" conaffinity="0"/>',
            '<geom type="sphere" size=".08" group="4" mass=".3"/>',
        ]
        kept = geoms[:1] + [one for one in geoms[1:] if self.chance(0.4)]
        if self.chance(0.4):
            kind = self.pick('diaginertia=".02 .03 .04"', 'fullinertia=".02 .03 .04 .001 -.002 .003"')
            place = f'pos="{self.numbers(3, 0.2)}"' if "full" in kind else self.place()
            kept.append(f'<inertial mass="1.7" {kind} {place}/>')
        return "".join(kept)

    def joint(self, prefix: str) -> str:
        name = f"{prefix}j{len(self.names)}"
        slides = self.chance(0.25)
        kind = self.pick("range", "range", "none", "off")
        ends = np.sort(self.rng.uniform(-1.5, 1.5, 2)) + np.array([-0.2, 0.2])
        ends = ends if slides else [self.angle(float(end)) for end in ends]
        words = [
            f'name="{name}"',
            f'type="{"slide" if slides else "hinge"}"',
            f'pos="{self.numbers(3, 0.1)}"',
        ]
        words += [f'axis="{self.numbers(3)}"'] if self.chance(0.6) else []
        words += ['class="odd"'] if self.chance(0.4) else []
        words += [] if kind == "none" else [f'range="{ends[0]:.17g} {ends[1]:.17g}"']
        words += ['limited="false"'] if kind == "off" else []
        if self.chance(0.4):
            words.append(f'ref="{0.3 if slides else self.angle(-0.7):.17g}"')
        self.names.append(name)
        if kind != "range" and not prefix:
            self.endless.append(name)
        return f"<joint {' '.join(words)}/>"

    def arm(self, prefix: str, count: int, tip: str) -> str:
        """Bodies with some joints each, with bodies and frames without joints between them."""
        inner, left = (
            f'<frame {self.place()}><site name="{tip}" {self.place()}/></frame>' if tip else "",
            count,
        )
        parts = []
        while left:
            here = min(left, int(self.rng.integers(1, 4)))
            left -= here
            parts.append("".join(self.joint(prefix) for _ in range(here)))
        for k, joints in enumerate(reversed(parts)):
            twin = tip if tip and k == 0 and self.chance(0.3) else f"{prefix}b{k}"
            of = ' childclass="odd"' if self.chance(0.2) else ""
            inner = f'<body name="{twin}"{of} {self.place()}>{joints}{self.mass()}{inner}</body>'
            if self.chance(0.4):
                inner = f'<body name="{prefix}f{k}" {self.place()}>{self.mass()}{inner}</body>'
            if self.chance(0.3):
                inner = f"<frame {self.place()}>{inner}</frame>"
        base = "<freejoint/>" if self.chance(0.2) else ""
        still = f'<body name="{prefix}plate" {self.place()}>{self.mass()}{inner}</body>'
        return f'<body name="{prefix}wall" {self.place()}>{base}{self.mass()}{still}</body>'

    def table(self) -> str:
        return f'<body name="table" {self.place()}><geom type="box" size=".5 .5 .02"/></body>'

    def cup(self) -> str:
        cups = f'<body {self.place()}><freejoint/><geom size=".05" mass=".2"/></body>'
        if self.chance(0.3):
            return f'<replicate count="3" offset=".1 0 0">{cups}</replicate>'
        return cups

    def hand_of_a_mouse(self) -> str:
        return f'<body name="mouse" mocap="true" {self.place()}><geom size=".02"/></body>'

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
