"""Shared parts of the pages: the templates and their filters."""

import pathlib
import re

import jinja2
import markupsafe

from . import text

TEMPLATES = pathlib.Path(__file__).parent / "templates"


def prose(sentence):
    """A sentence of the program, escaped, without breaks between a number and its unit or within an
    interval."""
    html = str(markupsafe.escape(sentence)).replace("–", "\u2060–\u2060")
    return markupsafe.Markup(re.sub(r"(?<=\d) (?=(?:%|s|ms|µs|min|h)\b|%)", "\u00a0", html))


def slug(name):
    """Letters, digits and '-' of a name, for files and anchors."""
    return re.sub(r"[^0-9A-Za-z]+", "-", name).strip("-") or "unnamed"


def render(template, **context):
    """The page of a template in TEMPLATES. Raises KeyError where `context` lacks a part."""
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(TEMPLATES), autoescape=True,
                                     undefined=jinja2.StrictUndefined, trim_blocks=True,
                                     lstrip_blocks=True)
    environment.filters.update(prose=prose, count=text.count, number=text.number, percent=text.percent,
                               seconds=text.seconds, estimate=text.value_and_bounds,
                               safe_svg=markupsafe.Markup)
    css = (TEMPLATES / "page.css").read_text(encoding="utf-8")
    try:
        return environment.get_template(template).render(css=markupsafe.Markup(css), **context)
    except jinja2.UndefinedError as missing:  # In the JSON of the run.
        raise KeyError(missing.message) from missing
