"""What all sheets share: the page, figures inside it, and numbers that say where they come from."""

from __future__ import annotations

import hashlib
import io
import json
import math
import re
from collections.abc import Mapping, Sequence
from decimal import Decimal
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup
    from matplotlib.figure import Figure

NOTHING = "–"
"""Printed where the document has no number (null)."""


def render(template: str, **context: object) -> str:
    """Fill a template of `rotorid/report/templates`.

    Parameters
    ----------
    template
        Its file name, such as "balance.html".
    context
        What the template names; a name that is missing is an error, never a blank.

    Raises
    ------
    jinja2.UndefinedError
        If the template names something that the context does not hold.
    """
    return _environment().get_template(template).render(**context)


def render_report(
    template: str,
    document: Mapping[str, Any],
    *,
    title: str,
    warnings: Sequence[str],
    provenance: Mapping[str, Any],
    **context: object,
) -> bytes:
    """Make a sheet: a template that extends base.html, filled from the JSON document of a result.

    The template gets `document`, `title`, `warnings`, `provenance`, `context`, and the function
    `show("corrections.0.mass", digits=4)`, which prints a number of the document (`Shown`). The document
    itself, with its provenance, lies in the sheet as JSON in the element "result".

    Parameters
    ----------
    template
        File name of the template.
    document
        What `--json` prints, without the provenance.
    title
        Heading of the sheet and title of the page.
    warnings
        Sentences, printed before everything else.
    provenance
        Program version, input files, date and options, as every JSON document has them.
    context
        What the template needs besides.

    Raises
    ------
    ValueError
        If the document holds a number that is not finite.
    """
    whole = {**document, "provenance": dict(provenance)}
    text = render(
        template,
        document=whole,
        title=title,
        warnings=list(warnings),
        provenance=provenance,
        json_text=json_inside(whole),
        show=Shown(whole),
        **context,
    )
    return text.encode("utf-8", "replace")  # names of files may be anything


def json_inside(document: Mapping[str, Any]) -> Markup:
    """JSON that may stand in a script element: no text in it can end the element.

    Raises
    ------
    ValueError
        If the document holds a number that is not finite.
    """
    from markupsafe import Markup

    text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for sign in "<>&\u2028\u2029":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return Markup(text)


class Shown:
    """Prints numbers of a document, each with the dotted path at which the document holds it.

    Parameters
    ----------
    document
        As JSON types.
    """

    def __init__(self, document: Mapping[str, Any]) -> None:
        self._document = document

    def __call__(
        self, key: str, digits: int = 3, decimals: int | None = None, unit: str = "", *, trim: bool = False
    ) -> Markup:
        """Print the number at a path as `<span data-key="path">number</span>`.

        Parameters
        ----------
        key
            Such as "corrections.0.mass".
        digits
            Significant digits; not used with `decimals`.
        decimals
            Digits after the point; with unit "°" a number that would round to 360 is printed as 0.
        unit
            Printed behind the number (inside the element, after a narrow space; "°" without one).
        trim
            Whether zeros at the end are left out: 3.36 with five digits, not 3.3600.

        Raises
        ------
        KeyError
            If the document has nothing there, or something that is neither a number nor null.
        """
        from markupsafe import Markup

        value = self.value(key)
        if value is None:
            return Markup('<span data-key="{}">{}</span>').format(key, NOTHING)
        text = significant(value, digits) if decimals is None else fixed(value, decimals, unit == "°")
        if trim and "." in text and "e" not in text:
            text = text.rstrip("0").rstrip(".")
        behind = unit if unit in ("", "°") else f"\u202f{unit}"
        return Markup('<span data-key="{}">{}{}</span>').format(key, text, behind)

    def value(self, key: str) -> float | None:
        """Return the number at a path; None where the document says null.

        Raises
        ------
        KeyError
            If the document has nothing there, or something that is neither a number nor null.
        """
        found = self.found(key)
        if found is None:
            return None
        if isinstance(found, bool) or not isinstance(found, int | float):
            raise KeyError(f"the document has no number at {key}")
        return float(found)

    def found(self, key: str) -> Any:  # noqa: ANN401
        """Return what the document holds at a path.

        Raises
        ------
        KeyError
            If it has nothing there.
        """
        found: Any = self._document
        for part in key.split("."):
            try:
                found = found[int(part)] if isinstance(found, list | tuple) else found[part]
            except (IndexError, KeyError, TypeError, ValueError):
                raise KeyError(f"the document has nothing at {key}") from None
        return found


def significant(value: float, digits: int = 3) -> str:
    """Print a number with significant digits, without an exponent from 0.0001 to 9999999.

    Examples
    --------
    >>> significant(416.93, 4), significant(0.04829), significant(13.0), significant(23900), significant(0)
    ('416.9', '0.0483', '13.0', '23900', '0')
    >>> significant(2.5e-7)
    '2.50e-07'
    """
    if not math.isfinite(value):
        return NOTHING
    if value == 0:
        return "0"
    rounded = f"{value:.{digits - 1}e}"
    exponent = int(rounded.partition("e")[2])
    if not -5 < exponent < 7:
        return rounded
    return f"{Decimal(rounded):.{max(0, digits - 1 - exponent)}f}"


def fixed(value: float, decimals: int, angle: bool = False) -> str:
    """Print a number with digits after the point; an angle of 359.96° becomes 0.0, and -0.0 becomes 0.0.

    Examples
    --------
    >>> fixed(9.514, 1), fixed(359.96, 1, angle=True), fixed(-0.01, 1)
    ('9.5', '0.0', '0.0')
    """
    if not math.isfinite(value):
        return NOTHING
    rounded = round(value, decimals)
    if angle and rounded == 360:
        rounded = 0.0
    return f"{rounded + 0.0:.{decimals}f}"


def inline_svg(figure: Figure, title: str) -> Markup:
    """Draw a figure as an SVG element that may stand in a page, with letters as outlines.

    It is as wide as the page allows, at most as wide as it was drawn; a figure for a telephone should be
    drawn 5 to 6 inches wide. The element refers to nothing outside, needs no font and carries no date; its
    ids begin with a hash of the picture and its title, so that they stay unique beside other figures.

    Parameters
    ----------
    figure
        Any size.
    title
        For people who do not see it.
    """
    import matplotlib as mpl
    from markupsafe import Markup, escape

    stream = io.StringIO()
    with mpl.rc_context({"svg.fonttype": "path", "svg.hashsalt": "rotorid"}):
        figure.savefig(stream, format="svg", metadata={"Date": None}, facecolor="white")
    text = stream.getvalue()
    head = re.search(r"<svg\b[^>]*>", text, re.DOTALL)
    if head is None:  # pragma: no cover - matplotlib always writes one
        raise ValueError("the figure could not be drawn")
    body = text[head.end() : text.rindex("</svg>")]
    for unwanted in (r"<metadata>.*?</metadata>", r"<style\b.*?</style>", r"<!--.*?-->"):
        body = re.sub(unwanted, "", body, flags=re.DOTALL)
    body = body.replace("xlink:href=", "href=")
    prefix = "f" + hashlib.sha256((title + body).encode("utf-8", "replace")).hexdigest()[:10] + "-"
    used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', body))
    body = re.sub(
        r'\s+id="([^"]*)"', lambda m: f' id="{prefix}{m.group(1)}"' if m.group(1) in used else "", body
    )
    body = re.sub(r'(href="#|url\(#)', rf"\g<1>{prefix}", body)
    body = re.sub(r"\n\s*", "\n", body)
    box = re.search(r'viewBox="([^"]*)"', head.group())
    view = box.group(1) if box else f"0 0 {figure.get_figwidth() * 72:g} {figure.get_figheight() * 72:g}"
    return Markup(
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="{escape(title)}" viewBox="{view}" '
        f'style="width:100%;max-width:{figure.get_figwidth():.2f}in;height:auto;stroke-linejoin:round;'
        f'stroke-linecap:butt">{body}</svg>'
    )


def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("rotorid.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["significant"] = significant
    environment.filters["fixed"] = fixed
    return environment
