"""Describes in sentences what was found, assumed and done. The numbers are in the report's `details`."""

from __future__ import annotations

_METHODS = {
    "model": "the filter and the network",
    "filter": "the filter",
    "model+refine": "the network, then refinement",
    "filter+refine": "the filter, then refinement",
    "refine": "refinement",
}
_LOOKS = {
    "classic": "a classic 3DGS fit",
    "antialiased": "an antialiased fit",
    "mip": "a Mip-Splatting fit",
    "filtered": "an already filtered splat",
    "enhanced": "an already enhanced splat",
    "raised": "a fit with raised opacities",
    "mesh": "a sampled mesh",
    "generated": "the output of a generator",
}


def report_of(kind: str, document: object, messages: list[tuple[str, str]], seconds: float) -> dict:
    """The report of a finished job, from the program's output."""
    row = document[0] if isinstance(document, list) and document else document
    row = row if isinstance(row, dict) else {}
    sentences = {"enhance": _enhanced, "convert": _converted, "render": _rendered}[kind](row)
    details = {key: value for key, value in row.items() if key not in ("input", "output", "view", "views")}
    return {
        "sentences": sentences,
        "warnings": [_named(text) for level, text in messages if level == "warning"],
        "notes": [_named(text) for level, text in messages if level == "info"],
        "details": details,
        "seconds": round(seconds, 3),
    }


def _named(text: str) -> str:
    return "the splat" + text[1:] if text.startswith("-:") else text


def _count(n: object) -> str:
    return f"{n:,}" if isinstance(n, int) else str(n)


def _enhanced(row: dict) -> list[str]:
    gaussians = row.get("gaussians", {})
    method = row.get("method", "")
    out = [
        f"{_count(gaussians.get('in'))} Gaussians in, {_count(gaussians.get('out'))} out, by {_METHODS.get(method, method)}."
    ]
    if gaussians.get("dropped"):
        out.append(f"{_count(gaussians['dropped'])} Gaussians were dropped: they hold numbers that cannot be drawn.")
    region = row.get("region") or {}
    if "kept_outside" in region:
        out.append(
            f"Of these {_count(region.get('gaussians'))} lie in the region and were enhanced; "
            f"{_count(region['kept_outside'])} outside of it stay as they were."
        )
    out += _looks(row)
    out += _pixel_size(row)
    cleaned = row.get("cleaned") or {}
    if "gaussians" in cleaned:
        out.append(f"Cleaning took out {_count(cleaned['gaussians'])} Gaussians of the background's colour.")
    refine = row.get("refine") or {}
    if refine.get("kept_start"):
        out.append("Refinement found nothing better than what it began with, which was kept.")
    elif (
        "consistency_after" in refine
        and refine["consistency_before"] is not None
        and refine["consistency_after"] is not None
    ):
        out.append(
            f"Refinement: agreement with the splat's own views {refine['consistency_before']:.1f} dB before, "
            f"{refine['consistency_after']:.1f} dB after."
        )
    return out


def _looks(row: dict) -> list[str]:
    reading = row.get("reading") or {}
    looks = reading.get("looks")
    if not looks:
        return []
    share = round(100 * min((reading.get("probabilities") or {}).get(looks, 0), 0.99))
    return [f"It looks like {_LOOKS.get(looks, looks)} ({share} %)."]


_MOST_NAMED = 4  # in a sentence


def _pixel_size(row: dict) -> list[str]:
    size, reading = row.get("pixel_size") or {}, row.get("reading") or {}
    value, source = size.get("value"), size.get("source")
    if not source:
        return []
    if value is None:
        return ["The splat was left unchanged: the size of a training pixel is unknown."]
    parts = row.get("parts") or []
    if parts:
        of_each = ", ".join(f"{p['pixel_size']:.4g} ({_count(p['gaussians'])} Gaussians)" for p in parts[:_MOST_NAMED])
        more = f" and {len(parts) - _MOST_NAMED} more" if len(parts) > _MOST_NAMED else ""
        return [f"The splat has {len(parts)} separate parts, with pixels of {of_each}{more}."]
    if source == "read" and reading:
        taken = f"; {value:.4g} was taken" if row.get("filter_strength") else ""  # otherwise a warning gives the reason
        return [
            f"A training pixel measured about {reading['pixel']:.4g} world units, as the splat looks "
            f"({reading['low']:.4g} to {reading['high']:.4g}){taken}. Cameras make it exact."
        ]
    known = {
        "given": f"The size of a training pixel was given: {value:.4g} world units.",
        "cameras": f"The size of a training pixel is that of the cameras: {value:.4g} world units in the middle.",
        "pictures": f"The size of a training pixel is that of the pictures: {value:.4g} world units in the middle.",
    }
    return [known.get(source, f"The size of a training pixel is {value:.4g} world units ({source}).")]


def _converted(row: dict) -> list[str]:
    formats, gaussians = row.get("formats") or ["?", "?"], row.get("gaussians", {})
    sizes, degrees = row.get("bytes", {}), row.get("sh_degree", {})
    out = [f"{formats[0]} to {formats[1]}: {_count(sizes.get('in'))} bytes became {_count(sizes.get('out'))}."]
    if gaussians.get("in") != gaussians.get("out"):
        out.append(f"{_count(gaussians.get('out'))} of {_count(gaussians.get('in'))} Gaussians were kept.")
    for step in row.get("actions") or []:
        if step.get("taken"):
            out.append(f"{step['action']}: {_count(step['taken'])} taken away, {_count(step['left'])} left.")
    axes = next((step["axes"] for step in row.get("actions") or [] if "axes" in step), None)
    if axes:
        out.append(f"The numbers of edits counted along {axes}.")
    if degrees.get("in") != degrees.get("out"):
        out.append(f"Spherical harmonics of degree {degrees.get('in')} became degree {degrees.get('out')}.")
    return out


def _rendered(row: dict) -> list[str]:
    views = row.get("views") or []
    return [f"{len(views)} {'picture' if len(views) == 1 else 'pictures'} of {_count(row.get('gaussians'))} Gaussians."]
