"""Keywords and defaults are those of the command line's declarations, both ways: what is added there without a keyword here, or
the other way round, fails."""

from __future__ import annotations

import inspect
import json
import re

import pytest

import anchorsplat

#: Verb and the group of its options that a function has, if not all; what is another way to say it in Python; what is not there,
#: and why.
SHARED = {
    "quiet": "messages go to logging and warnings",
    "json": "results are values",
    "progress": "a callback or a bar of tqdm",
}
OUTPUT = {"output": "results are values"}
SIZE = {"max-memory": "arrays are in memory already", "yes": "nobody is asked"}
PIPED = {"to": "results are values"}
FILES = {**OUTPUT, **PIPED, **SIZE, "out-dir": "results are values"}
#: Edits have an order, and keywords have none: the methods of Cloud and Edit.
METHODS = {
    "translate": "translate",
    "rotate": "rotate",
    "scale": "scale",
    "mirror": "mirror",
    "up": "turn_up",
    "origin": "move_origin",
    "filter-box": "crop",
    "remove-box": "remove_box",
    "filter-sphere": "crop",
    "filter-nan": "filter_nan",
    "filter-value": "filter_value",
    "filter-harmonics": "filter_harmonics",
    "filter-floaters": "filter_floaters",
}
EDITS = {
    **{option: f"Cloud.{method}" for option, method in METHODS.items()},
    "action-axes": "axes of edit",
    "dry-run": "nothing is written",
}
#: `view` takes edits as `convert` does, to show them.
VIEWED_EDITS = {**{option: f"Cloud.{method}" for option, method in METHODS.items()}, "action-axes": "axes of edit"}
FUNCTIONS = {
    "enhance": ("enhance", None, {}, {"view": "anchorsplat.view", "overwrite": "nothing is written", **FILES}),
    "fit": (
        "fit",
        None,
        {},
        {"overwrite": "nothing is written", "gsplat-checkpoint": "Cloud.to_gsplat", **OUTPUT, **PIPED},
    ),
    "render": (
        "render",
        None,
        {},
        {
            "overwrite": "nothing is written",
            "seed": "nothing is random",
            "enlarge-with": "anchorsplat.upscale",
            **OUTPUT,
        },
    ),
    "upscale": (
        "upscale",
        None,
        {},
        {
            "overwrite": "nothing is written",
            "seed": "nothing is random",
            "network": "the second argument",
            **OUTPUT,
        },
    ),
    "compare": (
        "compare",
        None,
        {},
        {
            "overwrite": "nothing is written",
            "seed": "nothing is random",
            "side-by-side": "anchorsplat.sheet",
            "summary": "the report has both",
            "lpips": "needs LibTorch",
            "lpips-weights": "needs LibTorch",
        },
    ),
    "view": (
        "view",
        None,
        {},
        {"overwrite": "Page.save", "seed": "nothing is random", "folder": "a page is one value", **VIEWED_EDITS, **OUTPUT},
    ),
    "convert": (
        "convert",
        None,
        {"from": "format"},
        {
            **SIZE,
            "to": "the target's name says it",
            "lod": "the target's name says it",
            "out-dir": "one at a time",
            "seed": "nothing is random",
            **EDITS,
        },
    ),
    "info": ("info", None, {"from": "format"}, {"overwrite": "nothing is written", "seed": "nothing is random"}),
    "refine": (
        "enhance",
        ("Refinement", "Shared flags", "Options", "Pixel size", "Device"),
        {},
        {
            "view": "anchorsplat.view",
            "overwrite": "nothing is written",
            "method": "it is refine",
            "quality": "it is refine",
            "clean": "of enhance",
            "enlarge-with": "of the method detail",
            **FILES,
        },
    ),
}
#: Keywords that no option stands for.
OWN = {"progress"}


@pytest.fixture(scope="session")
def declared(program):
    return json.loads(program("manual", "json").stdout)


def options_of(declared, verb, groups):
    found = {}
    for option in declared[verb]["options"]:
        long = [name[2:] for name in option["names"] if name.startswith("--")]
        for name in long:  # and its old names
            if groups is None or option["group"] in groups:
                found[name] = option
    return found


def as_python(option):
    """The default as a value of Python's."""
    text = option["default"]
    if not option["value"]:
        return False
    if text == "":
        return None
    try:
        return json.loads(text)
    except ValueError:
        return text


@pytest.mark.parametrize("name", FUNCTIONS)
def test_keywords_and_defaults_are_the_command_lines(declared, name):
    verb, groups, renamed, absent = FUNCTIONS[name]
    absent = {**absent, **SHARED}
    options = options_of(declared, verb, groups)
    if name != "refine":
        assert not set(absent) - set(options), "named as absent, but no option"
    keywords = {
        keyword: parameter.default
        for keyword, parameter in inspect.signature(getattr(anchorsplat, name)).parameters.items()
        if parameter.default is not inspect.Parameter.empty and keyword not in OWN
    }
    expected = {}
    for option, declaration in options.items():
        if option in absent:
            continue
        keyword = renamed.get(option, option).replace("-", "_")
        expected[keyword] = as_python(declaration)
    positional = {option["positional"] for option in declared[verb]["options"]}
    keywords = {keyword: value for keyword, value in keywords.items() if keyword not in positional}
    assert keywords == expected
    assert {type(v) for v in keywords.values()} <= {bool, int, float, str, type(None)}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_choices_are_the_command_lines(declared, name):
    verb, groups, renamed, absent = FUNCTIONS[name]
    annotations = inspect.get_annotations(getattr(anchorsplat, name))
    for option, declaration in options_of(declared, verb, groups).items():
        if option in absent or option in SHARED or not declaration["choices"]:
            continue
        annotation = annotations[renamed.get(option, option).replace("-", "_")]
        if annotation.split(" |")[0] in ("RenderMode", "Order"):
            continue  # held against the command line in test_named_choices
        if declaration["value"] in ("INT", "UINT"):
            continue
        words = re.findall(r"[\"']([^\"']+)[\"']", annotation)
        assert words == declaration["choices"], option


def test_named_choices(declared):
    from typing import get_args

    from anchorsplat._cloud import RenderMode
    from anchorsplat._files import Order

    convert = options_of(declared, "convert", None)
    assert list(get_args(RenderMode)) == convert["mode"]["choices"]
    assert list(get_args(Order)) == convert["sort"]["choices"]


def test_every_edit_is_a_method(declared):
    group = {
        name for option in declared["convert"]["options"] if option["group"].startswith("Edits") for name in option["names"]
    }
    assert {name[2:] for name in group if name.startswith("--")} == set(EDITS)
    for method in METHODS.values():
        for kind in (anchorsplat.Cloud, anchorsplat.Edit):
            assert getattr(kind, method).__doc__


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_keyword_is_documented(name):
    function = getattr(anchorsplat, name)
    seen_from = {"radius", "target", "fov", "up", "view", "size", "near", "far", "mode", "profile", "background"}
    elsewhere = {"refine": set(inspect.signature(function).parameters) - {"images"}, "compare": seen_from}
    for keyword in inspect.signature(function).parameters:
        if keyword not in {"threads", "progress", "seed", "cloud"} | elsewhere.get(name, set()):
            assert re.search(rf"\b{keyword}\b", function.__doc__), keyword


def test_everything_public_has_documentation_and_types():
    for name in anchorsplat.__all__:
        thing = getattr(anchorsplat, name)
        assert thing.__doc__, name
        if inspect.isclass(thing):
            for member, value in vars(thing).items():
                if not member.startswith("_") and (inspect.isfunction(value) or isinstance(value, property)):
                    assert value.__doc__, f"{name}.{member}"
        else:
            assert "return" in inspect.get_annotations(thing), name
