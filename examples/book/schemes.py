"""The ten schemes of the texts, drawn as SVG: masses, springs, dampers, beams and blocks.

`python examples/book/schemes.py [FOLDER]` writes them, by default beside the pages, in `schemes`.
Lengths are pixels, x to the right and y downwards.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from html import escape
from pathlib import Path

HEAD = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {0} {1}" width="{0}" height="{1}" '
    'font-family="sans-serif" font-size="14" fill="none" stroke="black" stroke-width="1.5">\n'
    '<rect width="100%" height="100%" fill="white" stroke="none"/>\n'
)


class Sheet:
    """A drawing of one size; every method adds one part."""

    def __init__(self, width: int, height: int) -> None:
        self.parts = [HEAD.format(width, height)]

    def line(self, *points: tuple[float, float]) -> None:
        """A line through points."""
        self.parts.append(f'<polyline points="{" ".join(f"{x:g},{y:g}" for x, y in points)}"/>\n')

    def text(self, x: float, y: float, words: str) -> None:
        """Words with their middle at a point."""
        self.parts.append(
            f'<text x="{x:g}" y="{y + 5:g}" text-anchor="middle" fill="black" stroke="none">'
            f"{escape(words)}</text>\n"
        )

    def box(self, x: float, y: float, words: str, width: float = 54, height: float = 44) -> None:
        """A mass, or a block of a feedback system, by its middle."""
        self.parts.append(
            f'<rect x="{x - width / 2:g}" y="{y - height / 2:g}" width="{width:g}" height="{height:g}" '
            'fill="#e6eef7"/>\n'
        )
        self.text(x, y, words)

    def circle(self, x: float, y: float, radius: float, words: str = "", above: float = 22) -> None:
        """A mass on a beam, or the place where signals are added."""
        self.parts.append(f'<circle cx="{x:g}" cy="{y:g}" r="{radius:g}" fill="#e6eef7"/>\n')
        self.text(x, y - above, words)

    def arrow(self, *points: tuple[float, float]) -> None:
        """A line with a head at its end, along x or y."""
        self.line(*points)
        (x0, y0), (x, y) = points[-2:]
        dx, dy = (6 * ((b > a) - (b < a)) for a, b in ((x0, x), (y0, y)))
        self.line((x - dx + dy / 2, y - dy + dx / 2), (x, y), (x - dx - dy / 2, y - dy - dx / 2))

    def wall(self, x: float, y: float, half: float = 34) -> None:
        """What does not move, at the end of a horizontal spring."""
        self.line((x, y - half), (x, y + half))

    def ground(self, x: float, y: float) -> None:
        """What does not move, below a vertical spring."""
        self.line((x - 18, y), (x + 18, y))

    def spring(self, x: float, y: float, length: float, words: str, *, down: bool = False) -> None:
        """From a point to the right, or downwards; its name beside it."""
        teeth = [0.0, 0.2, *(0.25 + 0.1 * i for i in range(6)), 0.8, 1.0]
        across = [0, 0, 8, -8, 8, -8, 8, -8, 0, 0]
        ways = [(length * t, a) for t, a in zip(teeth, across, strict=True)]
        self.line(*((x + a, y + t) if down else (x + t, y + a) for t, a in ways))
        self.text(*((x + 24, y + length / 2) if down else (x + length / 2, y - 20)), words)

    def damper(self, x: float, y: float, length: float, words: str) -> None:
        """From a point to the right."""
        near, far = x + 0.4 * length, x + 0.6 * length
        self.line((x, y), (near, y))
        self.line((far, y - 8), (near, y - 8), (near, y + 8), (far, y + 8))
        self.line((near + 4, y - 6), (near + 4, y + 6))
        self.line((near + 4, y), (x + length, y))
        self.text(x + length / 2, y + 22, words)

    def svg(self) -> str:
        """The whole drawing."""
        return "".join(self.parts) + "</svg>\n"


def direct_problem() -> Sheet:
    """[S] figure 1: a program that computes outputs."""
    sheet = Sheet(360, 100)
    sheet.box(180, 60, "program", 110)
    sheet.arrow((40, 60), (125, 60))
    sheet.text(70, 45, "θ, wanted")
    sheet.arrow((180, 8), (180, 38))
    sheet.text(225, 18, "α, known")
    sheet.arrow((235, 60), (320, 60))
    sheet.text(280, 45, "y")
    return sheet


def rotor() -> Sheet:
    """[S] figures 4 and 6: masses on a shaft without mass, on two supports."""
    sheet = _beam(("m₁", "m₂", "m₃"), (150, 260, 370), (80, 440), ("c₁", "c₂"))
    sheet.text(260, 150, "l")
    sheet.arrow((250, 150), (84, 150))
    sheet.arrow((270, 150), (436, 150))
    return sheet


def two_masses() -> Sheet:
    """[S] figure 7: two masses, three dampers."""
    sheet = Sheet(500, 120)
    sheet.wall(30, 60)
    sheet.wall(470, 60)
    for x, words, other in ((30, "c₁", "α₁"), (187, "c₂", "α₁₂")):
        sheet.spring(x, 48, 103, words)
        sheet.damper(x, 76, 103, other)
    sheet.damper(344, 76, 126, "α₂")
    sheet.box(160, 62, "m₁")
    sheet.box(317, 62, "m₂")
    sheet.arrow((160, 40), (160, 12), (205, 12))
    sheet.text(230, 12, "f(t)")
    return sheet


def feedback(forward: str, back: str) -> Sheet:
    """[S] figures 8 to 10: a closed loop with one block forward and one back."""
    sheet = Sheet(460, 150)
    sheet.arrow((20, 45), (78, 45))
    sheet.text(40, 30, "f")
    sheet.circle(88, 45, 10)
    sheet.text(106, 66, "−")
    sheet.arrow((98, 45), (130, 45))
    sheet.box(225, 45, forward, 190)
    sheet.arrow((320, 45), (440, 45))
    sheet.text(420, 30, "s")
    sheet.arrow((380, 45), (380, 115), (320, 115))
    sheet.box(225, 115, back, 190)
    sheet.arrow((130, 115), (88, 115), (88, 55))
    return sheet


def one_mass() -> Sheet:
    """[S] figure 11: one mass, a spring and a damper."""
    sheet = Sheet(320, 110)
    sheet.wall(40, 60)
    sheet.spring(40, 46, 110, "c")
    sheet.damper(40, 74, 110, "α")
    sheet.box(177, 60, "m")
    sheet.arrow((204, 60), (280, 60))
    sheet.text(245, 45, "F sin ωt")
    return sheet


def chain(springs: tuple[str, ...], closed: bool) -> Sheet:
    """[S] figure 12 and [F] figure 3.1: three masses in a row, the last one free or held, too."""
    sheet = Sheet(560 if closed else 440, 100)
    sheet.wall(30, 55)
    for i, words in enumerate(springs):
        sheet.spring(30 + 130 * i, 55, 76, words)
    for i in range(3):
        sheet.box(133 + 130 * i, 55, f"m{'₁₂₃'[i]}")
    if closed:
        sheet.wall(496, 55)
    return sheet


def beam_on_springs() -> Sheet:
    """[S] figure 13: two masses on a beam that is hinged at its ends, each on a spring."""
    sheet = Sheet(520, 170)
    sheet.line((60, 60), (460, 60))
    for x in (60, 460):
        sheet.line((x, 60), (x - 10, 78), (x + 10, 78), (x, 60))
    for x, mass, spring in ((180, "m₁", "c₁"), (300, "m₂", "c₂")):
        sheet.spring(x, 60, 80, spring, down=True)
        sheet.ground(x, 140)
        sheet.circle(x, 60, 12, mass)
    return sheet


def _beam(
    masses: tuple[str, ...], places: tuple[int, ...], supports: tuple[int, int], springs: tuple[str, str]
) -> Sheet:
    sheet = Sheet(520, 170)
    sheet.line((50, 60), (470, 60))
    for x, words in zip(supports, springs, strict=True):
        sheet.spring(x, 60, 70, words, down=True)
        sheet.ground(x, 130)
    for x, words in zip(places, masses, strict=True):
        sheet.circle(x, 60, 12, words)
    return sheet


SCHEMES: dict[str, Callable[[], Sheet]] = {
    "s_1": direct_problem,
    "s_4": rotor,
    "s_7": two_masses,
    "s_8": lambda: feedback("1 / (T₀p + 1)", "K / ((T₁p + 1) T₂p)"),
    "s_9": lambda: feedback("1 / (T₀p + 1)", "K / ((T₁p + 1)(T₂p + 1))"),
    "s_10": lambda: feedback("1 / (T₀²p² + 2ζT₀p + 1)", "K (T₁p + 1) / (T₂p + 1)"),
    "s_11": one_mass,
    "s_12": lambda: chain(("c₁", "c₂", "c₃"), closed=False),
    "s_13": beam_on_springs,
    "f_3_1": lambda: chain(("c₁", "c₂", "c₃", "c₄"), closed=True),
}
"""By text and number of the figure."""


def main(folder: Path) -> None:
    """Write every scheme."""
    folder.mkdir(exist_ok=True)
    for name, draw in SCHEMES.items():
        (folder / f"{name}.svg").write_text(draw().svg(), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("schemes"))
