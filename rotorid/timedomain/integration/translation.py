"""A small part of Python as machine code, by llvmlite: numbers, arrays, loops and conditions.

Functions have annotated arguments (`float`, `int`, `Array`: of floats, one dimension) and return an `int`.
What they hold is what the integration needs: assignments, `for … in range(…)`, `while`, `if`, arithmetic,
comparisons, functions of mathematics, calls of each other, and `shifted(array, i)`, the array from i on.
"""

from __future__ import annotations

import ast
import ctypes
import os
from collections.abc import Callable, Sequence
from typing import Any

UNARY = ("sin", "cos", "tan", "exp", "log", "tanh", "sinh", "cosh", "asin", "acos", "atan")
"""Functions of the C library."""
POWER = 64
"""Exponent up to which a power is written out as products."""


class Machine:
    """Compiled functions; they live as long as this object.

    Parameters
    ----------
    source
        Of the functions, each before those that call it.

    Raises
    ------
    ImportError, OSError, AttributeError
        llvmlite or the C library's mathematics is not there.
    """

    def __init__(self, source: str) -> None:
        import llvmlite.binding as llvm
        from llvmlite import ir

        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        library = ctypes.CDLL(None if os.name == "posix" else "ucrtbase")
        for name in (*UNARY, "pow"):
            address = ctypes.cast(getattr(library, name), ctypes.c_void_p).value
            llvm.add_symbol(f"rotorid_{name}", address)
        module = ir.Module()
        for node in ast.parse(source).body:
            assert isinstance(node, ast.FunctionDef)
            _Function(module, node)
        target = llvm.Target.from_default_triple().create_target_machine(opt=2)
        parsed = llvm.parse_assembly(str(module))
        builder = llvm.create_pass_builder(target, llvm.create_pipeline_tuning_options(speed_level=2))
        builder.getModulePassManager().run(parsed, builder)
        self._engine = llvm.create_mcjit_compiler(parsed, target)
        self._engine.finalize_object()

    def function(self, name: str, arguments: Sequence[type]) -> Callable[..., int]:
        """A compiled function, to be called with ctypes' types."""
        return ctypes.CFUNCTYPE(ctypes.c_int64, *arguments)(self._engine.get_function_address(name))  # type: ignore[no-any-return, unused-ignore]


class _Function:
    """Writes one function into a module."""

    def __init__(self, module: Any, node: ast.FunctionDef) -> None:  # noqa: ANN401  llvmlite has no types
        from llvmlite import ir

        self.ir, self.module = ir, module
        self.real, self.whole = ir.DoubleType(), ir.IntType(64)
        kinds = {"float": self.real, "int": self.whole, "Array": self.real.as_pointer()}
        arguments = [kinds[ast.unparse(a.annotation)] for a in node.args.args if a.annotation]
        function = ir.Function(module, ir.FunctionType(self.whole, arguments), node.name)
        self.places: dict[str, Any] = {}
        self.arrays: dict[str, Any] = {}
        self.entry = ir.IRBuilder(function.append_basic_block())
        self.b = ir.IRBuilder(function.append_basic_block())
        for argument, value in zip(node.args.args, function.args, strict=True):
            if value.type in (self.real, self.whole):
                self.store(argument.arg, value)
            else:
                value.add_attribute("noalias")
                self.arrays[argument.arg] = value
        first = self.b.block if not self.b.block.instructions else function.basic_blocks[1]
        self.statements(node.body)
        self.entry.branch(first)

    def store(self, name: str, value: Any) -> None:  # noqa: ANN401
        if name not in self.places:
            self.places[name] = self.entry.alloca(value.type)
        kind = self.places[name].allocated_type
        self.b.store(self.floating(value) if kind == self.real else value, self.places[name])

    def floating(self, value: Any) -> Any:  # noqa: ANN401
        if value.type == self.real:
            return value
        if isinstance(value, self.ir.Constant):
            return self.ir.Constant(self.real, float(value.constant))
        return self.b.sitofp(value, self.real)

    def statements(self, body: Sequence[ast.stmt]) -> None:
        for node in body:
            getattr(self, f"do_{type(node).__name__}")(node)

    def do_Expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Constant):  # a docstring
            self.value(node.value)

    def do_Return(self, node: ast.Return) -> None:
        self.b.ret(self.value(node.value))

    def do_Assign(self, node: ast.Assign) -> None:
        target, value = node.targets[0], self.value(node.value)
        if isinstance(target, ast.Name):
            self.store(target.id, value)
        else:
            self.b.store(self.floating(value), self.element(target))

    def do_AugAssign(self, node: ast.AugAssign) -> None:
        left = ast.parse(ast.unparse(node.target), mode="eval").body
        self.do_Assign(ast.Assign([node.target], ast.BinOp(left, node.op, node.value)))

    def do_If(self, node: ast.If) -> None:
        with self.b.if_else(self.value(node.test)) as (then, otherwise):
            with then:
                self.statements(node.body)
            with otherwise:
                self.statements(node.orelse)

    def do_While(self, node: ast.While) -> None:
        head, body, end = (self.b.append_basic_block() for _ in range(3))
        self.b.branch(head)
        self.b.position_at_end(head)
        self.b.cbranch(self.value(node.test), body, end)
        self.b.position_at_end(body)
        self.statements(node.body)
        self.b.branch(head)
        self.b.position_at_end(end)

    def do_For(self, node: ast.For) -> None:
        assert isinstance(node.iter, ast.Call)
        assert isinstance(node.target, ast.Name)
        limits = [self.value(limit) for limit in node.iter.args]
        name = node.target.id
        self.store(name, limits[0] if len(limits) > 1 else self.ir.Constant(self.whole, 0))
        self.store(f"{name} end", limits[-1])
        step = ast.parse(f"{name} = {name} + 1").body
        test = ast.Compare(ast.Name(name), [ast.Lt()], [ast.Name(f"{name} end")])
        self.do_While(ast.While(test, [*node.body, *step], []))

    def element(self, node: ast.expr) -> Any:  # noqa: ANN401
        assert isinstance(node, ast.Subscript)
        return self.b.gep(self.value(node.value), [self.value(node.slice)])

    def value(self, node: ast.expr | None) -> Any:  # noqa: ANN401
        return getattr(self, f"of_{type(node).__name__}")(node)

    def of_Constant(self, node: ast.Constant) -> Any:  # noqa: ANN401
        number: Any = node.value
        return self.ir.Constant(self.whole if isinstance(number, int) else self.real, number)

    def of_Name(self, node: ast.Name) -> Any:  # noqa: ANN401
        return self.arrays[node.id] if node.id in self.arrays else self.b.load(self.places[node.id])

    def of_Subscript(self, node: ast.Subscript) -> Any:  # noqa: ANN401
        return self.b.load(self.element(node))

    def of_UnaryOp(self, node: ast.UnaryOp) -> Any:  # noqa: ANN401
        value = self.value(node.operand)
        if isinstance(node.op, ast.Not):
            return self.b.not_(value)
        return self.b.neg(value) if value.type == self.whole else self.b.fneg(value)

    def of_BoolOp(self, node: ast.BoolOp) -> Any:  # noqa: ANN401
        left, *others = (self.value(part) for part in node.values)
        for other in others:
            left = (self.b.and_ if isinstance(node.op, ast.And) else self.b.or_)(left, other)
        return left

    def of_Compare(self, node: ast.Compare) -> Any:  # noqa: ANN401
        sign = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "=="}[type(node.ops[0])]
        left, right = self.value(node.left), self.value(node.comparators[0])
        if left.type == right.type == self.whole:
            return self.b.icmp_signed(sign, left, right)
        return self.b.fcmp_ordered(sign, self.floating(left), self.floating(right))

    def of_IfExp(self, node: ast.IfExp) -> Any:  # noqa: ANN401
        return self.b.select(self.value(node.test), self.value(node.body), self.value(node.orelse))

    def of_BinOp(self, node: ast.BinOp) -> Any:  # noqa: ANN401
        if isinstance(node.op, ast.Pow):
            return self.power(node)
        left, right = self.value(node.left), self.value(node.right)
        name = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div"}[type(node.op)]
        if left.type == right.type == self.whole and name != "div":
            return getattr(self.b, name)(left, right)
        return getattr(self.b, f"f{name}")(self.floating(left), self.floating(right))

    def power(self, node: ast.BinOp) -> Any:  # noqa: ANN401
        base = self.floating(self.value(node.left))
        try:
            exponent = ast.literal_eval(node.right)
        except ValueError:
            exponent = None
        if not isinstance(exponent, int) or not 0 < abs(exponent) <= POWER:
            return self.external("pow", [base, self.floating(self.value(node.right))])
        out, square = None, base
        for digit in reversed(f"{abs(exponent):b}"):
            if digit == "1":
                out = square if out is None else self.b.fmul(out, square)
            square = self.b.fmul(square, square)
        return out if exponent > 0 else self.b.fdiv(self.ir.Constant(self.real, 1.0), out)

    def of_Call(self, node: ast.Call) -> Any:  # noqa: ANN401
        assert isinstance(node.func, ast.Name)
        name, values = node.func.id, [self.value(a) for a in node.args]
        if name == "shifted":
            return self.b.gep(values[0], [values[1]])
        if name == "RealSign":
            zero, one = (self.ir.Constant(self.real, number) for number in (0.0, 1.0))
            up, down = (self.b.fcmp_ordered(sign, values[0], zero) for sign in (">", "<"))
            return self.b.fsub(self.b.select(up, one, zero), self.b.select(down, one, zero))
        if name in ("sqrt", "abs", "RealAbs"):
            inside = self.module.declare_intrinsic(
                f"llvm.{'sqrt' if name == 'sqrt' else 'fabs'}", [self.real]
            )
            return self.b.call(inside, [self.floating(values[0])])
        if name in UNARY:
            return self.external(name, [self.floating(value) for value in values])
        return self.b.call(self.module.get_global(name), values)

    def external(self, name: str, values: Sequence[Any]) -> Any:  # noqa: ANN401
        full = f"rotorid_{name}"  # a name that the optimiser does not know
        if full not in self.module.globals:
            kind = self.ir.FunctionType(self.real, [self.real] * len(values))
            self.ir.Function(self.module, kind, full)
        return self.b.call(self.module.get_global(full), values)
