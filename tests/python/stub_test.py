"""The type stubs have exactly the module's public names and arguments, and everything public is explained."""

import ast
import inspect
import pathlib
import re

import sparflow

STUB = ast.parse((pathlib.Path(sparflow.__file__).parent / "__init__.pyi").read_text())
# Methods of Python itself that the stubs name because they say how an object is used.
SPECIAL = {"__getitem__", "__contains__", "__len__", "__init__", "__call__", "_repr_html_", "__add__", "__radd__", "__sub__",
           "__rsub__", "__mul__", "__rmul__", "__truediv__", "__rtruediv__", "__pow__", "__neg__", "__pos__", "__abs__", "__gt__", "__ge__",
           "__lt__", "__le__"}
ALIASES = {"Array", "Flags", "Path", "Progress", "State", "Levers", "Controller", "Logs", "Effects"}


def public(names):
    return {n for n in names if not n.startswith("_")}


def classes():
    return {node.name: node for node in STUB.body if isinstance(node, ast.ClassDef)}


def functions(body):
    return {node.name: node for node in body if isinstance(node, ast.FunctionDef)}


def module_names():
    return {n for n in public(dir(sparflow)) if not inspect.ismodule(getattr(sparflow, n))}


def arguments(node):
    """Names of arguments with the text of their defaults, keyword-only ones marked."""
    a = node.args
    defaults = [None] * (len(a.args) - len(a.defaults)) + a.defaults
    given = [(arg.arg, False, d) for arg, d in zip(a.args, defaults) if arg.arg != "self"]
    given += [(arg.arg, True, d) for arg, d in zip(a.kwonlyargs, a.kw_defaults)]
    return [(name, only, None if d is None else ast.literal_eval(d)) for name, only, d in given]


def arguments_of_function(function):
    kinds = inspect.Parameter
    return [(p.name, p.kind == kinds.KEYWORD_ONLY, None if p.default is kinds.empty else p.default)
            for p in inspect.signature(function).parameters.values() if p.name != "self" and p.kind != kinds.VAR_KEYWORD]


def names_in_docstring(member):
    """Arguments of a function of the library, from the signature that its docstring begins with."""
    inside = re.match(r"\w+\((.*)\) -> ", member.__doc__.splitlines()[0])[1]
    return [n for n in re.findall(r"(?:^|, )(\w+): ", inside) if n != "self"]


def test_the_names_are_the_modules():
    stubbed = set(classes()) | set(functions(STUB.body))
    assert stubbed == module_names()
    named = {t.target.id for t in STUB.body if isinstance(t, ast.AnnAssign)}
    assert named == {"__version__"} and ALIASES.isdisjoint(module_names())


def test_functions_have_the_stubs_arguments():
    for name, node in functions(STUB.body).items():
        function = getattr(sparflow, name)
        if inspect.isfunction(function):
            assert arguments(node) == arguments_of_function(function), name
        else:
            assert [a[0] for a in arguments(node)] == names_in_docstring(function), name


def test_classes_have_the_stubs_members():
    for name, node in classes().items():
        cls = getattr(sparflow, name)
        bases = [ast.unparse(b) for b in node.bases]
        assert [b.__name__ for b in cls.__bases__ if b.__name__ not in ("object", "pybind11_object")] == bases, name
        stubbed = functions(node.body)
        plain = {b.target.id for b in node.body if isinstance(b, ast.AnnAssign)}
        own = public(vars(cls))
        # Attributes that an object gets when it is made are no members of its class.
        assert public(stubbed) | (plain & own) == own, name
        for member, definition in stubbed.items():
            assert not member.startswith("_") or member in SPECIAL, member
            there = inspect.getattr_static(cls, member)
            is_property = any(ast.unparse(d) == "property" for d in definition.decorator_list)
            assert is_property == isinstance(there, property), (name, member)
            if is_property:
                continue
            callable_ = getattr(cls, member)
            if inspect.isfunction(callable_):
                assert arguments(definition) == arguments_of_function(callable_), (name, member)
            elif not member.startswith("_"):
                assert [a[0] for a in arguments(definition)] == names_in_docstring(callable_), (name, member)


def test_every_operator_of_a_formula_stands_in_its_stub():
    # Those that only refuse (a branch, a number) or serve NumPy say nothing of how a formula is used.
    others = {"__init__", "__repr__", "__bool__", "__float__", "__array_ufunc__", "__array_function__"}
    own = {name for name, member in vars(sparflow.Formula).items() if inspect.isfunction(member)} - others
    assert own == set(functions(classes()["Formula"].body)) - others and {"__pos__", "__gt__", "__le__"} <= own


def test_everything_public_is_explained_in_words_of_python():
    for name in module_names():
        thing = getattr(sparflow, name)
        members = [(name, thing)]
        if inspect.isclass(thing):
            members += [(f"{name}.{m}", inspect.getattr_static(thing, m)) for m in public(vars(thing))]
        for at, member in members:
            if at.split(".")[-1] in ("file", "line", "column", "key", "result") and "Error" in at:
                continue  # attributes that the class explains
            text = inspect.getdoc(member.__func__ if isinstance(member, staticmethod) else member) or ""
            described = re.sub(r"^\w+\(.*\) -> .*\n*", "", text)
            assert described.strip(), f"{at} has no docstring"
            assert "::" not in text, f"{at} shows a C++ type: {text}"
            assert max(map(len, described.splitlines())) <= 140, f"{at} has a long line"
        if inspect.isclass(thing):
            assert thing.__module__ in ("sparflow", "sparflow._effects", "sparflow._errors"), name


def test_units_stand_where_numbers_do():
    for name, unit in dict(plan=r"\[s\]", price=r"\[kg\]", simulate=r"\[s\].*\[Hz\]", audit=r"\[kg\].*\[s\]", evaluate=r"\[m/s\].*\[N\].*\[W\]",
                           pareto=r"\[kW\]", strategies=r"\[kW\]", benchmark=r"\[s\]").items():
        assert re.search(unit, inspect.getdoc(getattr(sparflow, name)), re.DOTALL), name
