"""Defects of one line, drawn from the source: signs, factors, indices, comparisons, conjugates.

Not drawn: annotations, texts with their format widths, tolerances of rounding (numbers below 1e-4), what
pictures look like (`COSMETICS`: sizes, colours, places of texts), and other operators between lists, always
a TypeError that every test would find.
"""

from __future__ import annotations

import ast
import random
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

PACKAGES = ("fem", "balancing", "rotorid")
OPERATORS = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.Lt: ("<", "<=", ">"),
    ast.LtE: ("<=", "<", ">="),
    ast.Gt: (">", ">=", "<"),
    ast.GtE: (">=", ">", "<="),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.And: ("and", "or"),
    ast.Or: ("or", "and"),
}
"""As written, and what stands in its place."""
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


@dataclass(frozen=True, order=True)
class Mutation:
    """One change of one line of a file: bytes `begin` to `end`, within a function ("" at module level)."""

    path: str
    line: int
    begin: int
    end: int
    new: str
    function: str

    def applied(self, source: str) -> str:
        """The source with this change."""
        data = source.encode()
        return (data[: self.begin] + self.new.encode() + data[self.end :]).decode()

    def shown(self, source: str) -> tuple[str, str]:
        """The line before and after."""
        before, after = (text.split("\n")[self.line - 1].strip() for text in (source, self.applied(source)))
        return before, after


class _Finder(ast.NodeVisitor):
    """Every possible mutation of a module."""

    def __init__(self, path: str, source: str) -> None:
        self.path, self.data = path, source.encode()
        self.starts = [0]
        for line in self.data.split(b"\n"):
            self.starts.append(self.starts[-1] + len(line) + 1)
        self.mutations: set[Mutation] = set()
        self.names: list[str] = []
        self.functions = 0

    # places

    def span(self, node: ast.expr) -> tuple[int, int]:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return (
            self.starts[node.lineno - 1] + node.col_offset,
            self.starts[node.end_lineno - 1] + node.end_col_offset,
        )

    def text(self, node: ast.expr) -> str:
        """Source of a node on one line, "" of others."""
        begin, end = self.span(node)
        return self.data[begin:end].decode() if node.lineno == node.end_lineno else ""

    def change(self, begin: int, end: int, new: str) -> None:
        line = self.data.count(b"\n", 0, begin) + 1
        function = ".".join(self.names) if self.functions else ""
        self.mutations.add(Mutation(self.path, line, begin, end, new, function))

    def replace(self, node: ast.expr, new: str) -> None:
        if node.lineno == node.end_lineno:
            self.change(*self.span(node), new)

    def between(self, kind: ast.AST, left: ast.expr, right: ast.expr, more: str = "") -> None:
        """Replace the operator between two nodes."""
        old, *others = OPERATORS.get(type(kind), ("",))
        begin = self.data.find((old + more).encode(), self.span(left)[1], self.span(right)[0])
        for new in others if begin >= 0 else ():
            self.change(begin, begin + len(old + more), new + more)

    # what is not looked at

    def _function(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        for each in (*node.decorator_list, *node.args.defaults, *filter(None, node.args.kw_defaults)):
            self.visit(each)
        outside = list(self.names)
        self.names += ["<locals>", node.name] if self.functions else [node.name]
        self.functions += 1
        for statement in node.body:
            self.visit(statement)
        self.functions -= 1
        self.names = outside

    visit_FunctionDef = visit_AsyncFunctionDef = _function

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self.names.append(node.name)
        for statement in node.body:
            self.visit(statement)
        self.names.pop()

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
        names = [each.id for each in node.targets if isinstance(each, ast.Name)]
        types = isinstance(node.value, ast.Subscript) and any(name[0].isupper() for name in names)
        if not types or any(name == name.upper() for name in names):
            self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if not _is_list(node):
            self.between(node.op, node.left, node.right)
            if isinstance(node.op, ast.Mult | ast.Div | ast.Pow):
                self.number(node.left)
                self.number(node.right)
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        if not _is_list(node.value):
            self.between(node.op, node.target, node.value, "=")
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.USub) and not isinstance(node.operand, ast.Constant):
            begin = self.span(node)[0]
            self.change(begin, begin + 1, "+")
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        for operator, (left, right) in zip(node.ops, pairwise([node.left, *node.comparators]), strict=True):
            self.between(operator, left, right)
            if type(operator) in OPERATORS:
                self.number(left)
                self.number(right)
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        for left, right in pairwise(node.values):
            self.between(node.op, left, right)
        self.generic_visit(node)

    def visit_Subscript(self, node: ast.Subscript) -> None:
        for part in node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]:
            for each in (part.lower, part.upper) if isinstance(part, ast.Slice) else (part,):
                if each is not None:
                    self.index(each)
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        method = isinstance(node.func, ast.Attribute)
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if name in ("cast", "TypeVar"):
            return
        if name in DROPPED and not node.keywords:
            if len(node.args) == 1 and self.text(node.args[0]):
                self.replace(node, f"({self.text(node.args[0])})")
            elif not node.args and method and self.text(node.func.value):
                self.replace(node, self.text(node.func.value))
        self.generic_visit(node)

    def _condition(self, node: ast.If | ast.IfExp | ast.While) -> None:
        if isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            return
        self.negate(node.test)
        self.generic_visit(node)

    visit_If = visit_IfExp = visit_While = _condition

    def visit_comprehension(self, node: ast.comprehension) -> None:
        for each in node.ifs:
            self.negate(each)
        self.generic_visit(node)

    def negate(self, test: ast.expr) -> None:
        if not isinstance(test, ast.Constant):  # no other end of an endless loop
            self.replace(test, f"(not ({self.text(test)}))")

    def number(self, node: ast.expr) -> None:
        """A factor or a limit: 2 → 3, 0.5 → 0.25."""
        value = _value(node)
        if isinstance(value, int):
            self.replace(node, str(value + 1))
        elif isinstance(value, float) and (abs(value) >= ROUNDING or value == 0):
            self.replace(node, repr(value / 2 or 1.0))

    def index(self, node: ast.expr) -> None:
        """0 → 1, −1 → −2, i → i + 1."""
        negative = isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub)
        value = _value(node.operand if negative else node)
        if isinstance(value, int) and (value or not negative):
            self.replace(node, str(-value - 1 if negative else value + 1))
        elif isinstance(node, ast.Name) and len(node.id) == 1 and node.id.islower():
            self.replace(node, f"{node.id} + 1")


def _value(node: ast.expr) -> object:
    return node.value if isinstance(node, ast.Constant) and not isinstance(node.value, bool) else None


def _is_list(node: ast.expr) -> bool:
    """Another operator would be a TypeError, which every test finds: no test of the tests."""
    if isinstance(node, ast.IfExp):
        return _is_list(node.body) or _is_list(node.orelse)
    if isinstance(node, ast.BinOp):
        return _is_list(node.left) or _is_list(node.right)
    if isinstance(node, ast.Call):
        return isinstance(node.func, ast.Name) and node.func.id in ("list", "tuple", "sorted", "str")
    lists = ast.List | ast.ListComp | ast.Tuple | ast.JoinedStr
    return isinstance(node, lists) or isinstance(_value(node), str)


@cache
def possible(path: str, source: str) -> tuple[Mutation, ...]:
    """Every mutation of a module, in the order of the lines."""
    finder = _Finder(path, source)
    finder.visit(ast.parse(source))
    return tuple(sorted(finder.mutations))


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


def shares(number: int, sizes: dict[str, int]) -> dict[str, int]:
    """`number` split in proportion to the sizes, by largest remainders."""
    exact = {name: number * size / sum(sizes.values()) for name, size in sizes.items()}
    whole = {name: int(value) for name, value in exact.items()}
    rest = sorted(exact, key=lambda name: (whole[name] - exact[name], name))
    return {name: whole[name] + (name in rest[: number - sum(whole.values())]) for name in exact}


def draw(root: Path, seed: int, number: int) -> list[Mutation]:
    """So many mutations, over the packages, and over the modules of each, in proportion to their lines.

    Never two of the same line. A module, one of its lines with anything to change, one of the changes.
    """
    sources = {
        package: {
            path.relative_to(root).as_posix(): path.read_text(encoding="utf-8")
            for path in sorted((root / package).rglob("*.py"))
        }
        for package in PACKAGES
    }
    sizes = {package: sum(map(code_lines, texts.values())) for package, texts in sources.items()}
    drawn: list[Mutation] = []
    for package, count in shares(number, sizes).items():
        rng = random.Random(f"{seed} {package}")
        texts = sources[package]
        names, weights = list(texts), [code_lines(text) for text in texts.values()]
        taken: set[tuple[str, int]] = set()
        for _ in range(1000 * count):
            if len(taken) == count:
                break
            name = rng.choices(names, weights)[0]
            choices = possible(name, texts[name])
            lines = sorted({mutation.line for mutation in choices})
            if not lines:
                continue
            line = rng.choice(lines)
            mutation = rng.choice([each for each in choices if each.line == line])
            if (name, line) not in taken and is_python(mutation.applied(texts[name])):
                taken.add((name, line))
                drawn.append(mutation)
    return drawn
