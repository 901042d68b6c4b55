"""Options of jobs, with the names, ranges and defaults of the command line (docs/cli.md). Unknown names are refused."""

from __future__ import annotations

import json
import re
from typing import Annotated, ClassVar, Literal, Union

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from .. import _core
from .._errors import BadArgumentError

#: Formats of results, with their HTTP content types.
FORMATS = {
    "ply": "application/octet-stream",
    "compressed.ply": "application/octet-stream",
    "spz": "application/octet-stream",
    "sog": "application/zip",
    "splat": "application/octet-stream",
    "glb": "model/gltf-binary",
    "gltf": "application/zip",  # two files
    "npz": "application/octet-stream",
    "csv": "text/csv",
}
Format = Literal["ply", "compressed.ply", "spz", "sog", "splat", "glb", "gltf", "npz", "csv"]
Mode = Literal["classic", "antialiased", "mip"]
_COLOR = r"^(0(\.\d+)?|1(\.0+)?|\.\d+)(,(0(\.\d+)?|1(\.0+)?|\.\d+)){2}$"
_VECTOR = r"^[-+]?\d{1,9}(\.\d{1,9})?(,[-+]?\d{1,9}(\.\d{1,9})?){2}$"
_NUMBER = r"[-+]?(\d{1,9}(\.\d{0,18})?|\.\d{1,18})([eE][-+]?\d{1,2})?"
# A sphere or a box. The program parses it; this only rejects obvious errors early.
_REGION = rf"^{_NUMBER}(,{_NUMBER}){{3}}((,{_NUMBER}){{2}})?$"


class Options(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, validate_default=False)
    #: Edits, applied in order and repeatable, with a description and the form of the value.
    in_order: ClassVar[dict[str, tuple[str, str]]] = {}

    def canonical(self) -> str:
        """Canonical text of a request: explicit and implied defaults are the same."""
        return json.dumps(self.model_dump(exclude_none=True), sort_keys=True)


class EnhanceOptions(Options):
    quality: Literal["fast", "good"] = Field(
        "fast", description="fast: a second; good: the network, then a little refinement, several seconds"
    )
    upscale: float = Field(4.0, ge=1, le=64, description="how many times closer it will be seen")
    pixel_size: Union[Literal["auto"], Annotated[float, Field(gt=0, lt=1e9)]] = Field(
        "auto", description="world size of one pixel of the training views; auto: of the cameras, else read from the splat"
    )
    mode: Mode | None = Field(
        None, description="how it was rasterized in training; default: the file's tag, else as the splat looks"
    )
    copies: Union[Literal["auto"], Annotated[int, Field(ge=1, le=4)]] = Field(
        "auto", description="Gaussians made of each, at most"
    )
    max_gaussians: int = Field(0, ge=0, le=2**31 - 1, description="budget of the result; 0: none")
    region: str | None = Field(
        None,
        pattern=_REGION,
        description="only what lies in there is enhanced, the rest stays bit by bit: a sphere X,Y,Z,RADIUS or a box "
        "X0,Y0,Z0,X1,Y1,Z1 by two corners, in the splat's unit",
    )
    train_width: int | None = Field(
        None, ge=1, le=65535, description="of the training pictures, where it was less than the cameras say"
    )
    clean: bool = Field(
        False, description="first take out Gaussians of the background's colour that no training view would miss"
    )
    background: str | None = Field(None, pattern=_COLOR, description="R,G,B from 0 to 1, of the training views")

    @model_validator(mode="after")
    def _belongs_together(self):
        if self.background is not None and not self.clean:
            raise ValueError("background has an effect only with clean")
        return self

    def words(self, cameras: bool) -> list[str]:
        out = ["--quality", self.quality, "--upscale", repr(self.upscale)]
        if self.pixel_size != "auto":
            out += ["--pixel-size", repr(self.pixel_size)]
        if self.mode:
            out += ["--mode", self.mode]
        if self.copies != "auto":
            out += ["--copies", str(self.copies)]
        if self.max_gaussians:
            out += ["--max-gaussians", str(self.max_gaussians)]
        if self.region is not None:
            out += [f"--region={self.region}"]  # one word, as it may begin with a minus
        if cameras:
            out += ["--cameras", "cameras.json"]
        if self.train_width is not None:
            out += ["--train-width", str(self.train_width)]
        if self.clean:
            out += ["--clean"]
        if self.background is not None:
            out += ["--background", self.background]
        return out


class ConvertOptions(Options):
    in_order = {name[2:].replace("-", "_"): (help, form) for name, help, form in _core.edit_names()}

    to: Format = Field("spz", description="format of the result")
    mode: Mode | None = Field(
        None, description="how the splat is rasterized, for a tag in the result; default: as the input says"
    )
    sh_degree: int | None = Field(None, ge=0, le=3, description="spherical harmonics to keep")
    min_opacity: float = Field(0.0, ge=0, le=1, description="drop Gaussians that are fainter")
    max_gaussians: int | None = Field(
        None, ge=1, le=2**31 - 1, description="keep at most so many, those of the largest size x opacity"
    )
    sort: Literal["format", "keep", "morton", "importance"] = Field(
        "format", description="order of the Gaussians in the file"
    )
    spz_version: Literal[3, 4] = Field(4, description="3 for programs that only know gzip")
    coords: str | None = Field(
        None,
        pattern=r"^([LRUDFB]{3})?:([LRUDFB]{3})?$",
        description="what the axes really are where they do not follow the format, as IN:OUT",
    )

    edits: list[tuple[str, str]] = Field([], max_length=64, description="in their order: name and value")
    action_axes: str | None = Field(
        None,
        description="axes along which the numbers of edits are: LUF (the default), x left, y up and z forward; RDF as region "
        "and target count",
    )

    @model_validator(mode="after")
    def _edits_are_some(self):
        if self.action_axes is not None and not self.edits:
            raise ValueError("action_axes has an effect only with edits, such as translate")
        for name, value in self.edits:
            if name not in self.in_order:
                raise ValueError(f"{name} is not an edit")
            if not value.isprintable():
                raise ValueError(f"{name}: its value contains control characters")
            try:
                _core.check_edit(_option(name), value, self.action_axes or "LUF")
            except BadArgumentError as error:
                raise ValueError(str(error)) from None
        return self

    @field_validator("spz_version", mode="before")
    @classmethod
    def _digit(cls, value):
        return int(value) if isinstance(value, str) and value in ("3", "4") else value

    def words(self) -> list[str]:
        out = ["--sort", self.sort]
        if self.to == "spz":
            out += ["--spz-version", str(self.spz_version)]
        if self.mode:
            out += ["--mode", self.mode]
        if self.sh_degree is not None:
            out += ["--sh-degree", str(self.sh_degree)]
        if self.min_opacity:
            out += ["--min-opacity", repr(self.min_opacity)]
        if self.max_gaussians is not None:
            out += ["--max-gaussians", str(self.max_gaussians)]
        if self.coords is not None:
            out += ["--coords", self.coords]
        if self.action_axes is not None:
            out += ["--action-axes", self.action_axes]
        for name, value in self.edits:  # one word, as a value may begin with a minus
            out += [f"{_option(name)}={value}" if value else _option(name)]
        return out


def _option(name: str) -> str:
    return "--" + name.replace("_", "-")


class RenderOptions(Options):
    orbit: int = Field(1, ge=1, le=120, description="views on a sphere around the splat")
    size: str = Field("1024x1024", description="WxH in pixels, at most 4096x4096")
    fov: float = Field(45.0, ge=1, le=170, description="horizontal field of view, degrees")
    radius: float | None = Field(
        None, gt=0, lt=1e9, description="distance in world units; default: what frames the splat"
    )
    target: str | None = Field(None, pattern=_VECTOR, description="X,Y,Z to look at; default: the splat's middle")
    up: str | None = Field(
        None,
        pattern=r"^(-?[xyz]|[-+]?\d{1,9}(\.\d{1,9})?(,[-+]?\d{1,9}(\.\d{1,9})?){2})$",
        description="where up is: X,Y,Z or an axis such as -z",
    )
    background: str | None = Field(None, pattern=_COLOR, description="R,G,B from 0 to 1; default black")
    transparent: bool = Field(False, description="an alpha channel instead of a background")
    mode: Mode | None = Field(None, description="rasterization; default: the file's tag, else classic")

    @field_validator("size")
    @classmethod
    def _bounded(cls, text: str) -> str:
        match = re.fullmatch(r"(\d{1,4})x(\d{1,4})", text)
        if not match or not all(1 <= int(side) <= 4096 for side in match.groups()):
            raise ValueError("must be WxH, each from 1 to 4096, such as 800x600")
        return text

    @model_validator(mode="after")
    def _belongs_together(self):
        if self.transparent and self.background is not None:
            raise ValueError("a background has no effect on transparent pictures")
        return self

    def words(self) -> list[str]:
        out = ["--orbit", str(self.orbit), "--size", self.size, "--fov", repr(self.fov)]
        for name in ("radius", "target", "up", "background", "mode"):
            value = getattr(self, name)
            if value is not None:
                out += [f"--{name}={value}"]  # one word, as a value may begin with a minus
        if self.transparent:
            out += ["--transparent"]
        return out


KINDS: dict[str, type[Options]] = {"enhance": EnhanceOptions, "convert": ConvertOptions, "render": RenderOptions}
