"""What a report says to people, of what the program prints."""

from __future__ import annotations

from anchorsplat.serve.words import report_of

_READING = {"looks": "classic", "probabilities": {"classic": 0.976}, "pixel": 0.01, "low": 0.008, "high": 0.0125}
_ROW = {"method": "model", "gaussians": {"in": 1000, "out": 3000}, "filter_strength": 0.74}


def _said(**row) -> str:
    return " ".join(report_of("enhance", [_ROW | row], [], 1.0)["sentences"])


def test_what_was_read_and_taken_is_said() -> None:
    said = _said(reading=_READING, pixel_size={"value": 0.009, "source": "read"})
    assert "It looks like a classic 3DGS fit (98 %)." in said
    assert "0.01 world units" in said and "0.009 was taken" in said


def test_nothing_is_taken_of_a_splat_that_stays_as_it_is() -> None:
    said = _said(reading=_READING, pixel_size={"value": 0.009, "source": "read"}, filter_strength=0)
    assert "0.01 world units" in said and "taken" not in said


def test_each_thing_has_its_pixel() -> None:
    sizes = [(700, 0.01, True), (300, 0.04, False)]
    parts = [{"gaussians": n, "pixel_size": size, "by_network": network} for n, size, network in sizes]
    said = _said(reading=_READING, pixel_size={"value": 0.01, "source": "read"}, parts=parts)
    assert "2 separate parts" in said and "0.04 (300 Gaussians)" in said


def test_a_pixel_that_nothing_tells_is_none() -> None:
    said = _said(pixel_size={"value": None, "source": "unknown"}, filter_strength=0)
    assert "pixel is unknown" in said and "looks like" not in said
