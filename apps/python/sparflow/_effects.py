"""Effects written as Python functions. The function is called once, with signals and parameters that note what is done with
them; the formula that comes out is an effect like those of a YAML file (docs/user_effects.md): its units are checked, its
derivatives are exact, and no Python runs while a model is evaluated."""

import json
import math
import pathlib

from ._errors import UsageError


class Formula:
    """A formula in signals and parameters: + - * / **, comparisons inside step(), NumPy's functions of one value, np.where,
    np.clip, and np.interp over a table of numbers."""

    __array_priority__ = 1000  # before NumPy's arrays, which are no formulas

    def __init__(self, text):
        self.text = text

    def __repr__(self):
        return self.text

    def __add__(self, other): return _joined(self, "+", other)
    def __radd__(self, other): return _joined(other, "+", self)
    def __sub__(self, other): return _joined(self, "-", other)
    def __rsub__(self, other): return _joined(other, "-", self)
    def __mul__(self, other): return _joined(self, "*", other)
    def __rmul__(self, other): return _joined(other, "*", self)
    def __truediv__(self, other): return _joined(self, "/", other)
    def __rtruediv__(self, other): return _joined(other, "/", self)
    def __pow__(self, other): return _joined(self, "^", other)
    def __neg__(self): return Formula(f"(-{self.text})")
    def __pos__(self): return self
    def __abs__(self): return _called("abs", self)
    def __gt__(self, other): return _Comparison(self, ">", other)
    def __ge__(self, other): return _Comparison(self, ">=", other)
    def __lt__(self, other): return _Comparison(self, "<", other)
    def __le__(self, other): return _Comparison(self, "<=", other)

    def __bool__(self):
        raise UsageError("an effect's function is called once and gives a formula, so that it cannot branch on a signal; "
                         "write sparflow.step(s.v > 0) * ... in place of `if`")

    def __float__(self):
        raise UsageError("a signal or parameter has no number while the formula is made; use NumPy's functions "
                         "(np.tanh), not those of `math`")

    def __array_ufunc__(self, ufunc, method, *inputs, **options):
        name = {"absolute": "abs", "maximum": "max", "minimum": "min"}.get(ufunc.__name__, ufunc.__name__)
        if ufunc.__name__ in _OPERATORS and method == "__call__" and not options:
            return _joined(inputs[0], _OPERATORS[ufunc.__name__], inputs[1])
        if name not in _FUNCTIONS or method != "__call__" or options:
            raise UsageError(f"a formula has no {ufunc.__name__}; it has {', '.join(sorted(_FUNCTIONS))}")
        return _called(name, *inputs)

    def __array_function__(self, function, types, args, options):
        made = {"interp": _table, "clip": _clipped, "where": _chosen}.get(function.__name__)
        if made is None:
            raise UsageError(f"a formula has no {function.__name__}; it has interp, clip, where, {', '.join(sorted(_FUNCTIONS))}")
        return made(*args, **options)


class _Comparison:
    def __init__(self, left, mark, right):
        self.text = f"{_text(left)} {mark} {_text(right)}"

    __array_function__ = Formula.__array_function__

    def __bool__(self):
        return Formula.__bool__(self)


_OPERATORS = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/", "power": "^"}
_FUNCTIONS = {"abs", "sign", "square", "sqrt", "exp", "log", "tanh", "sin", "cos", "max", "min"}


def _text(value):
    if isinstance(value, Formula):
        return value.text
    number = float(value)
    if not math.isfinite(number):
        raise UsageError(f"a formula has no {number}")
    return repr(number) if number >= 0 else f"({number!r})"


def _joined(left, mark, right):
    return Formula(f"({_text(left)} {mark} {_text(right)})")


def _called(name, *values):
    return Formula(f"{name}({', '.join(_text(v) for v in values)})")


def _table(x, xp, fp):
    """np.interp over fixed numbers: a sum of kinks; `x` has no unit."""
    try:
        xp, fp = [float(v) for v in xp], [float(v) for v in fp]
    except TypeError:
        raise UsageError("np.interp in an effect needs a list of numbers for xp and for fp") from None
    if len(xp) != len(fp) or len(xp) < 2 or any(b <= a for a, b in zip(xp, xp[1:])):
        raise UsageError("np.interp in an effect needs xp that increases and as many values in fp, two at least")
    slopes = [0.0, *((d - c) / (b - a) for a, b, c, d in zip(xp, xp[1:], fp, fp[1:])), 0.0]
    value = Formula(_text(fp[0]))
    for at, before, behind in zip(xp, slopes, slopes[1:]):
        if behind != before:
            value = value + (behind - before) * positive(x - at)
    return value


def _clipped(x, lowest, highest):
    return _called("min", _called("max", x, lowest), highest)


def _chosen(condition, there, elsewhere):
    return step(condition) * there + (1 - step(condition)) * elsewhere


def step(condition):
    """1 where a comparison holds (sparflow.step(s.v > 0)) or a value is positive, else 0."""
    return Formula(f"step({condition.text if isinstance(condition, _Comparison) else _text(condition)})")


def positive(value):
    """max(0, value), whatever its unit."""
    return _called("positive", value)


def quantity(number, unit):
    """A number with a unit, e.g. quantity(40, 'degC') or quantity(20, 'bar')."""
    return Formula(f"{_text(number)}[{unit}]")


class _Names:
    """Signals (s.v, s.F, s.pA, s.q.boom ...) or parameters; each is noted as its name."""

    def __init__(self, known=None, before=""):
        self._known, self._before = known, before

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        if self._known is not None and name not in self._known:
            raise UsageError(f"the effect has no parameter {name}; it has {', '.join(self._known)}")
        if not self._before and self._known is None and name in ("q", "qd", "qdd"):
            return _Names(before=name + ".")
        return Formula(self._before + name)


class Effect:
    """An effect of your own: give it as `effects=` to fit, diagnose, extend, improve and selftest."""

    def __init__(self, function, keys):
        self.id, self.function = keys["id"], function
        self.law = _text(function(_Names(), _Names(keys["parameters"])))
        # JSON is YAML as well.
        self.definition = json.dumps({"effects": [dict(keys, law=self.law)]}, ensure_ascii=False)
        code = function.__code__
        self.place = f"{pathlib.Path(code.co_filename).name}, {function.__name__}() in line {code.co_firstlineno}"
        self.__doc__ = function.__doc__

    def __call__(self, signals, parameters):
        """The function itself, for numbers and arrays."""
        return self.function(signals, parameters)

    def __repr__(self):
        return f"<sparflow effect {self.id}: {self.law}>"


def effect(stage, parameters, *, id=None, **keys):
    """Makes an Effect of a function of signals and parameters that returns what is added in SI: force [N], flow [m^3/s],
    pressure or pump pressure [Pa].

        @sparflow.effect(stage="force", parameters={
            "Fc": dict(unit="N", bounds=[0, 20000], typical=3000), "v0": dict(unit="mm/s", bounds=[0.5, 50], typical=5)})
        def seal_friction(s, p):
            "Seal friction of the rod"
            return p.Fc * np.tanh(s.v / p.v0)

    Signals, their units and further keys (at, title, citation, confused_with ...) are those of docs/user_effects.md; the id
    is the function's name, the title its docstring's first line. Raises UsageError where the function is no formula.
    """
    def made(function):
        words = dict(keys, id=id or function.__name__, stage=stage, parameters=dict(parameters))
        if function.__doc__:
            words.setdefault("title", function.__doc__.strip().splitlines()[0])
        return Effect(function, words)
    return made
