"""Defects of one line, drawn from the source: signs, factors, indices, comparisons, conjugates.

Not drawn: annotations, texts with their format widths, tolerances of rounding (numbers below 1e-4), what
pictures look like (`COSMETICS`: sizes, colours, places of texts), and other operators between lists, always
a TypeError that every test would find.
"""

from __future__ import annotations

import ast
import io
import random
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

PACKAGES = ("fem", "balancing", "rotorid")
ARITHMETIC = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*")}
COMPARISONS = {
    ast.Lt: ("<", ("<=", ">")),
    ast.LtE: ("<=", ("<", ">=")),
    ast.Gt: (">", (">=", "<")),
    ast.GtE: (">=", (">", "<=")),
    ast.Eq: ("==", ("!=",)),
    ast.NotEq: ("!=", ("==",)),
}
LOGIC = {ast.And: ("and", "or"), ast.Or: ("or", "and")}
DROPPED = {"abs", "conj", "conjugate"}
ROUNDING = 1e-4
COSMETICS = frozenset(
    """
    figsize linewidth lw linewidths alpha fontsize size color colors c s dpi zorder pad w_pad h_pad labelpad
    rotation markersize ms markeredgewidth xytext bbox_to_anchor borderaxespad frameon width height capsize
    linestyle ls dashes margins hspace wspace height_ratios width_ratios left right top bottom ncol ncols
    shrink fraction aspect headwidth levels
    """.split()  # noqa: SIM905
)


@dataclass(frozen=True)
class Mutation:
    """One change of one line of a file."""

    path: str
    line: int
    begin: int
    end: int
    old: str
    new: str
    function: str
    """Qualified name of the function around it, empty at module level."""

    def applied(self, source: str) -> str:
        """The source with this change."""
        lines = source.split("\n")
        text = lines[self.line - 1]
        assert text[self.begin : self.end] == self.old
        lines[self.line - 1] = text[: self.begin] + self.new + text[self.end :]
        return "\n".join(lines)

    def shown(self, source: str) -> tuple[str, str]:
        """The line before and after."""
        before, after = (text.split("\n")[self.line - 1].strip() for text in (source, self.applied(source)))
        return before, after


class _Finder(ast.NodeVisitor):
    """Every possible mutation of a module."""

    def __init__(self, path: str, source: str) -> None:
        self.path, self.lines = path, source.split("\n")
        self.tokens: dict[int, list[tokenize.TokenInfo]] = {}
        for token in tokenize.generate_tokens(io.StringIO(source).readline):
            if token.type in (tokenize.OP, tokenize.NAME):
                self.tokens.setdefault(token.start[0], []).append(token)
        self.found: list[Mutation] = []
        self.where: list[str] = []
        self.inside: list[bool] = []

    # places

    def column(self, line: int, offset: int) -> int:
        return len(self.lines[line - 1].encode()[:offset].decode())

    def span(self, node: ast.expr) -> tuple[tuple[int, int], tuple[int, int]]:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return (
            (node.lineno, self.column(node.lineno, node.col_offset)),
            (node.end_lineno, self.column(node.end_lineno, node.end_col_offset)),
        )

    def text(self, node: ast.expr) -> str | None:
        """Source of a node on one line."""
        (line, begin), (last, end) = self.span(node)
        return self.lines[line - 1][begin:end] if line == last else None

    def add(self, line: int, begin: int, end: int, new: str) -> None:
        old = self.lines[line - 1][begin:end]
        function = ".".join(self.where) if any(self.inside) else ""
        self.found.append(Mutation(self.path, line, begin, end, old, new, function))

    def replace(self, node: ast.expr, new: str) -> None:
        (line, begin), (last, end) = self.span(node)
        if line == last:
            self.add(line, begin, end, new)

    def between(self, left: ast.expr, right: ast.expr, old: str, *new: str) -> None:
        """Replace the operator between two nodes."""
        start, stop = self.span(left)[1], self.span(right)[0]
        for line in range(start[0], stop[0] + 1):
            for token in self.tokens.get(line, ()):
                if token.string == old and start <= token.start and token.end <= stop:
                    for text in new:
                        self.add(line, token.start[1], token.end[1], text)
                    return

    # what is not looked at

    def _function(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        for each in (*node.decorator_list, *node.args.defaults, *filter(None, node.args.kw_defaults)):
            self.visit(each)
        if any(self.inside):
            self.where.append("<locals>")
        self.where.append(node.name)
        self.inside.append(True)
        for statement in node.body:
            self.visit(statement)
        self.inside.pop()
        self.where.pop()
        if any(self.inside):
            self.where.pop()

    visit_FunctionDef = visit_AsyncFunctionDef = _function

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self.where.append(node.name)
        for statement in node.body:
            self.visit(statement)
        self.where.pop()

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Texts and their widths stay."""

    def visit_keyword(self, node: ast.keyword) -> None:
        if node.arg not in COSMETICS or "plot" not in self.path:
            self.visit(node.value)

    # what is drawn

    def visit_Assign(self, node: ast.Assign) -> None:
        names = {each.id for each in node.targets if isinstance(each, ast.Name)}
        types = isinstance(node.value, ast.Subscript) and any(name[0].isupper() for name in names)
        if not types or not all(name != name.upper() for name in names):
            self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if any(map(_is_list, (node.left, node.right))):
            self.generic_visit(node)
            return
        if type(node.op) in ARITHMETIC:
            old, new = ARITHMETIC[type(node.op)]
            self.between(node.left, node.right, old, new)
        if isinstance(node.op, ast.Mult | ast.Div | ast.Pow):
            for each in (node.left, node.right):
                self.number(each)
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        if type(node.op) in ARITHMETIC and not _is_list(node.value):
            old, new = ARITHMETIC[type(node.op)]
            self.between(node.target, node.value, f"{old}=", f"{new}=")
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.USub) and not isinstance(node.operand, ast.Constant):
            line, begin = self.span(node)[0]
            self.add(line, begin, begin + 1, "+")
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        operands = [node.left, *node.comparators]
        for operator, left, right in zip(node.ops, operands, operands[1:], strict=False):
            if type(operator) in COMPARISONS:
                old, new = COMPARISONS[type(operator)]
                self.between(left, right, old, *new)
                for each in (left, right):
                    self.number(each)
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        old, new = LOGIC[type(node.op)]
        for left, right in zip(node.values, node.values[1:], strict=False):
            self.between(left, right, old, new)
        self.generic_visit(node)

    def visit_Subscript(self, node: ast.Subscript) -> None:
        parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        for part in parts:
            for each in (part.lower, part.upper) if isinstance(part, ast.Slice) else (part,):
                if each is not None:
                    self.index(each)
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if name in ("cast", "TypeVar"):
            return
        if name in DROPPED and not node.keywords:
            if len(node.args) == 1 and self.text(node.args[0]) is not None:
                self.replace(node, f"({self.text(node.args[0])})")
            elif not node.args and isinstance(node.func, ast.Attribute) and self.text(node.func.value):
                self.replace(node, str(self.text(node.func.value)))
        self.generic_visit(node)

    def _condition(self, test: ast.expr) -> None:
        text = self.text(test)
        if text is not None and not (isinstance(test, ast.Name) and test.id == "TYPE_CHECKING"):
            self.replace(test, f"(not ({text}))")

    def visit_If(self, node: ast.If) -> None:
        if not (isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"):
            self._condition(node.test)
            self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self._condition(node.test)
        self.generic_visit(node)

    def visit_While(self, node: ast.While) -> None:
        if not isinstance(node.test, ast.Constant):
            self._condition(node.test)
        self.generic_visit(node)

    def visit_comprehension(self, node: ast.comprehension) -> None:
        for each in node.ifs:
            self._condition(each)
        self.generic_visit(node)

    def number(self, node: ast.expr) -> None:
        """A factor or a limit: 2 → 3, 0.5 → 0.25."""
        value = _value(node)
        if isinstance(value, int):
            self.replace(node, str(value + 1))
        elif isinstance(value, float) and abs(value) >= ROUNDING:
            self.replace(node, repr(value / 2))
        elif isinstance(value, float) and value == 0:
            self.replace(node, "1.0")

    def index(self, node: ast.expr) -> None:
        """0 → 1, −1 → −2, i → i + 1."""
        value = _value(node)
        negative = isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) and _value(node.operand)
        if type(value) is int:
            self.replace(node, str(value + 1))
        elif type(negative) is int and negative:
            self.replace(node, str(-negative - 1))
        elif isinstance(node, ast.Name) and len(node.id) == 1 and node.id.islower():
            self.replace(node, f"{node.id} + 1")


def _value(node: ast.expr) -> object:
    return node.value if isinstance(node, ast.Constant) and not isinstance(node.value, bool) else None


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or isinstance(_value(node), str)


def _is_list(node: ast.expr) -> bool:
    """Another operator would be a TypeError, which every test finds: no test of the tests."""
    if isinstance(node, ast.IfExp):
        return _is_list(node.body) or _is_list(node.orelse)
    if isinstance(node, ast.BinOp):
        return _is_list(node.left) or _is_list(node.right)
    if isinstance(node, ast.Call):
        return isinstance(node.func, ast.Name) and node.func.id in ("list", "tuple", "sorted", "str")
    return isinstance(node, ast.List | ast.ListComp | ast.Tuple) or _is_text(node)


@cache
def possible(path: str, source: str) -> tuple[Mutation, ...]:
    """Every mutation of a module, in the order of the lines."""
    finder = _Finder(path, source)
    finder.visit(ast.parse(source))
    return tuple(sorted(set(finder.found), key=lambda m: (m.line, m.begin, m.end, m.new)))


def is_python(source: str) -> bool:
    """Whether a source can be compiled."""
    try:
        compile(source, "mutated", "exec")
    except SyntaxError:
        return False
    return True


def code_lines(source: str) -> int:
    """Lines that hold code, neither blank nor of a comment alone."""
    return sum(1 for line in source.split("\n") if line.strip() and not line.strip().startswith("#"))


def modules(root: Path, package: str) -> Iterator[tuple[str, str]]:
    """Paths from the root, with their sources."""
    for path in sorted((root / package).rglob("*.py")):
        yield path.relative_to(root).as_posix(), path.read_text(encoding="utf-8")


def shares(number: int, sizes: dict[str, int]) -> dict[str, int]:
    """`number` split in proportion to the sizes, by largest remainders."""
    exact = {name: number * size / sum(sizes.values()) for name, size in sizes.items()}
    found = {name: int(value) for name, value in exact.items()}
    rest = sorted(exact, key=lambda name: (found[name] - exact[name], name))
    for name in rest[: number - sum(found.values())]:
        found[name] += 1
    return found


def draw(root: Path, seed: int, number: int) -> list[Mutation]:
    """So many mutations, over the packages, and over the modules of each, in proportion to their lines.

    Never two of the same line. A module, one of its lines with anything to change, one of the changes.
    """
    sources = {package: dict(modules(root, package)) for package in PACKAGES}
    sizes = {package: sum(map(code_lines, found.values())) for package, found in sources.items()}
    drawn: list[Mutation] = []
    for package, count in shares(number, sizes).items():
        rng = random.Random(f"{seed} {package}")
        own = sources[package]
        names, weights = list(own), [code_lines(text) for text in own.values()]
        taken: set[tuple[str, int]] = set()
        for _ in range(1000 * count):
            if len(taken) == count:
                break
            name = rng.choices(names, weights)[0]
            choices = possible(name, own[name])
            lines = sorted({mutation.line for mutation in choices})
            if not lines:
                continue
            line = rng.choice(lines)
            mutation = rng.choice([each for each in choices if each.line == line])
            if (name, line) not in taken and is_python(mutation.applied(own[name])):
                taken.add((name, line))
                drawn.append(mutation)
    return drawn
