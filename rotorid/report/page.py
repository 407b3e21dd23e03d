"""Page that all sheets share: figures inside it, and numbers that say where they come from."""

from __future__ import annotations

import hashlib
import io
import json
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rotorid.base.json import SCHEMA_VERSION
from rotorid.base.tables import LONG, Table, html
from rotorid.base.text import figures

if TYPE_CHECKING:
    from collections.abc import Callable

    from markupsafe import Markup
    from matplotlib.figure import Figure

WIDTH, LETTERS = 6.0, 9.0
"""Of a picture on a page: inches and points."""
ABREAST = 10
"""Columns of a table that stand side by side."""


def render_report(
    template: str,
    document: Mapping[str, Any],
    *,
    title: str,
    warnings: Sequence[str],
    provenance: Mapping[str, Any],
    **context: object,
) -> bytes:
    """Make a sheet: a template that extends base.html; the document lies in it as JSON, in "result".

    Parameters
    ----------
    template
        File name in `rotorid/report/templates`, such as "balance.html".
    document
        What `--json` prints, without the provenance.
    title
        Heading of the sheet and title of the page.
    warnings
        Sentences.
    provenance
        Program version, input files, date and options, as every JSON document has them.
    context
        What the template needs besides.

    Raises
    ------
    ValueError
        If the document holds a number that is not finite.
    jinja2.UndefinedError
        If the template names something that the context does not hold.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    whole = {**document, "schema_version": SCHEMA_VERSION, "provenance": dict(provenance)}
    pages = Environment(
        loader=PackageLoader("rotorid.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    pages.filters["figures"] = figures
    text = pages.get_template(template).render(
        document=whole,
        title=title,
        warnings=list(warnings),
        provenance=provenance,
        json_text=json_inside(whole),
        **context,
    )
    return text.encode("utf-8", "replace")  # names of files may be anything


def block(table: Table | str | Callable[[], str], longest: int = LONG) -> Markup:
    """A table, those too wide in parts that repeat its first two columns; or text as it stands."""
    from markupsafe import Markup

    table = table() if callable(table) else table
    if isinstance(table, str):
        return Markup("<pre>{}</pre>").format(table)
    first, others, step = table.columns[:2], table.columns[2:], ABREAST - 2
    parts = [(*first, *others[k : k + step]) for k in range(0, max(len(others), 1), step)]
    return Markup("\n").join(html(Table(table.name, part, table.note), longest) for part in parts)


def drawn(draw: Callable[[], Figure], caption: str) -> Markup:
    """A picture as wide as a telephone."""
    import matplotlib as mpl

    with mpl.rc_context({"font.size": LETTERS, "hatch.linewidth": 0.6}):
        figure = draw()
        wide, high = figure.get_size_inches()
        figure.set_size_inches(WIDTH, high * min(1.0, WIDTH / wide))
        return inline_svg(figure, caption)


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
    assert head is not None  # matplotlib always writes one
    body = text[head.end() : text.rindex("</svg>")]
    unwanted = r"<metadata>.*?</metadata>|<style\b.*?</style>|<!--.*?-->|xlink:(?=href=)"
    body = re.sub(unwanted, "", body, flags=re.DOTALL)
    prefix = "f" + hashlib.sha256((title + body).encode("utf-8", "replace")).hexdigest()[:10] + "-"
    used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', body))
    body = re.sub(
        r'\s+id="([^"]*)"', lambda m: f' id="{prefix}{m.group(1)}"' if m.group(1) in used else "", body
    )
    body = re.sub(r'(href="#|url\(#)', rf"\g<1>{prefix}", body)
    body = re.sub(r"\n\s*", "\n", body)
    wide, high = figure.get_size_inches()
    return Markup(
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="{escape(title)}" '
        f'viewBox="0 0 {wide * 72:g} {high * 72:g}" '
        f'style="width:100%;max-width:{wide:.2f}in;height:auto;stroke-linejoin:round;'
        f'stroke-linecap:butt">{body}</svg>'
    )
