"""Keyword arguments, typed. Made by generate_keywords.py from the declarations of the options: change those."""

import os
from collections.abc import Mapping
from typing import Literal, TypeAlias, TypedDict

from trueup._photographs import Picture

Path: TypeAlias = str | os.PathLike[str]
Value: TypeAlias = bool | int | float | str | os.PathLike[str]


class SaveKeywords(TypedDict, total=False):
    """Keywords of a panorama's file."""

    quality: int
    """JPEG quality on the usual scale of the Independent JPEG Group. Raise it for prints, lower it where the file is
    too large to send (default 92)."""
    depth: Literal["auto", "8", "16", "float"]
    """Bits of a sample; JPEG, WebP and Deep Zoom have 8, OpenEXR and Radiance are float. Choose 16 or float when the
    panorama is to be edited further, 8 when 16-bit photographs are to make a small file (default auto)."""
    background: str
    """What shows where no photograph is. A color is laid under the panorama in every format, unless alpha is kept:
    choose one to match the page or print that the panorama is put on (default auto)."""
    set: Mapping[str, Value]
    """Any options by their names, table.option."""
    config: Path
    """A TOML file with options, which set and keywords overrule."""


class ComposeKeywords(SaveKeywords, total=False):
    """Keywords of composing."""

    scale: float
    """Size of the panorama relative to the reference photograph's own pixels: 1 keeps every detail the reference has.
    Lower it for a quick preview (0.25) or a smaller file; raise it only if the reference was taken with a shorter lens
    than the others (default 1.0)."""
    look: Literal["natural", "linear", "hdr"]
    """How photographs of very different exposure come together. Choose `linear` to measure light or to finish tones by
    hand, `hdr` for detail in sun and shade alike. Photographs of like exposure look the same with all of them (default
    natural)."""
    projection: Literal[
        "auto",
        "mesh",
        "equirectangular",
        "cylindrical",
        "perspective",
        "mercator",
        "panini",
        "stereographic",
    ]
    """What the panorama is drawn on. Choose equirectangular for viewers of spherical panoramas, the mesh where
    photographs that were taken from several places do not meet, and any other as you like it (default auto)."""
    yaw: float
    """Turns the viewer to the right of where the panorama faces: change it to bring another place to the middle. Not
    for the mesh, as the next three (default 0.0)."""
    pitch: float
    """Turns the viewer up: change it where the panorama shows too much ground, or too much sky (default 0.0)."""
    roll: float
    """Turns the viewer clockwise: change it where the panorama leans (default 0.0)."""
    fov: float
    """Horizontal field of view that may be shown; 0 shows what is there, as far as the projection carries well. Lower
    it to leave stretched sides out, raise it to see them (default 0.0)."""
    crop: Literal["auto", "rectangle", "none"]
    """What of the canvas is kept. Choose `none` for all that the photographs show, with ragged borders (default
    auto)."""
    fill: float
    """Gaps between and beside the photographs of up to twice this width, as a share of a photograph's side, are filled
    as what lies beside them goes on. 0 fills nothing; raise it to 0.1 where ragged borders lie in a sky, a lawn or a
    wall, in which small fillings are not noticed (default 0.0)."""
    memory: str
    """Memory that the work may take; auto is a quarter of the machine's, or more where less is too little. With less,
    the canvas goes to a scratch file and photographs are decoded again. Set it where other programs need theirs
    (default auto)."""
    scratch: str
    """Folder for the scratch file; empty for the folder of the panorama. Set it where that disk is slow or full."""
    threads: int
    """Number of threads; 0 for one per core. The panorama is the same for any number."""


class StitchKeywords(ComposeKeywords, total=False):
    """Keywords of stitching."""

    scene: Literal["auto", "rotating", "plane"]
    """What the photographs show, and how their cameras moved. Say `plane` where a document or a facade that was taken
    in two photographs comes out bent; `rotating` where a flat wall was taken from one place and is drawn as a plane
    (default auto)."""
    lens: Literal["auto", "pinhole", "rectilinear", "fisheye"]
    """What kind of lens took the photographs. Say it where few photographs overlap, which tell little of a lens, or
    where a line that is straight comes out bent (default auto)."""
    lens_fov: float
    """Field of view of every photograph across its longer side, through the whole lens, by any calibration or
    specification; the matches may still change the focal length by up to 5 %. Say it where photographs carry no focal
    length, or a wrong one; 0 leaves it to them (default 0.0)."""
    stacks: Literal["auto", "light", "none"]
    """Which photographs are fused before they are stitched: those that show one view at several exposures (a bracket),
    one after the other or pass by pass. Choose light for the light of all exposures in a panorama that is not written
    with floating point samples, or not yet. Choose none to have each of them stitched as it is (default auto)."""
    method: Literal[
        "vpg",
        "gsp-2d",
        "gsp-3d",
        "vpg-published",
        "vpg-literal",
        "gsp-2d-published",
        "gsp-3d-published",
        "aanap-published",
        "straightening",
        "homography",
        "autostitch",
        "apap",
        "sphp",
        "sphp-free",
        "aanap",
        "quasi-homography",
    ]
    """How the panorama's shape is found. Choose another one to compare, or for photographs that it serves better
    (default vpg)."""
    align: Literal["auto", "points", "lines", "photometric", "lines+photometric"]
    """What draws overlapping photographs together. Where things stand twice or lines break at seams, take more than
    auto does: it is slower and shows fewer ghosts (default auto)."""
    structure: Literal["none", "lines"]
    """What of the photographs' structure is kept, beyond the neighborhoods of grid vertices. Choose lines where long
    edges bend (default none)."""
    seed: int
    """Every random choice, from the verification of pairs on, derives from this number. Change it to see how much of a
    result is chance (default 0)."""
    masks: Mapping[str, Picture]
    """Files or arrays by the names of photographs: what is black or transparent in them is ignored."""
    keep: Mapping[str, Picture]
    """Files or arrays by the names of photographs: what is white in them is shown."""
    reference: str
    """The photograph that sets the pixel scale and stays in place; auto takes the one in the middle."""
    graph: Path
    """A text file with the pairs to be matched, NAME -- NAME a line."""
    lens_from: Path
    """The project of other photographs through the same lens, which is taken from there."""
    require_all: bool
    """Fails unless every photograph is used."""
    cache: Path
    """A folder for what is found in the photographs, for later runs."""


class BatchKeywords(SaveKeywords, total=False):
    """Keywords of a batch."""

    scene: Literal["auto", "rotating", "plane"]
    """What the photographs show, and how their cameras moved. Say `plane` where a document or a facade that was taken
    in two photographs comes out bent; `rotating` where a flat wall was taken from one place and is drawn as a plane
    (default auto)."""
    lens: Literal["auto", "pinhole", "rectilinear", "fisheye"]
    """What kind of lens took the photographs. Say it where few photographs overlap, which tell little of a lens, or
    where a line that is straight comes out bent (default auto)."""
    lens_fov: float
    """Field of view of every photograph across its longer side, through the whole lens, by any calibration or
    specification; the matches may still change the focal length by up to 5 %. Say it where photographs carry no focal
    length, or a wrong one; 0 leaves it to them (default 0.0)."""
    stacks: Literal["auto", "light", "none"]
    """Which photographs are fused before they are stitched: those that show one view at several exposures (a bracket),
    one after the other or pass by pass. Choose light for the light of all exposures in a panorama that is not written
    with floating point samples, or not yet. Choose none to have each of them stitched as it is (default auto)."""
    scale: float
    """Size of the panorama relative to the reference photograph's own pixels: 1 keeps every detail the reference has.
    Lower it for a quick preview (0.25) or a smaller file; raise it only if the reference was taken with a shorter lens
    than the others (default 1.0)."""
    look: Literal["natural", "linear", "hdr"]
    """How photographs of very different exposure come together. Choose `linear` to measure light or to finish tones by
    hand, `hdr` for detail in sun and shade alike. Photographs of like exposure look the same with all of them (default
    natural)."""
    projection: Literal[
        "auto",
        "mesh",
        "equirectangular",
        "cylindrical",
        "perspective",
        "mercator",
        "panini",
        "stereographic",
    ]
    """What the panorama is drawn on. Choose equirectangular for viewers of spherical panoramas, the mesh where
    photographs that were taken from several places do not meet, and any other as you like it (default auto)."""
    crop: Literal["auto", "rectangle", "none"]
    """What of the canvas is kept. Choose `none` for all that the photographs show, with ragged borders (default
    auto)."""
    fill: float
    """Gaps between and beside the photographs of up to twice this width, as a share of a photograph's side, are filled
    as what lies beside them goes on. 0 fills nothing; raise it to 0.1 where ragged borders lie in a sky, a lawn or a
    wall, in which small fillings are not noticed (default 0.0)."""
    method: Literal[
        "vpg",
        "gsp-2d",
        "gsp-3d",
        "vpg-published",
        "vpg-literal",
        "gsp-2d-published",
        "gsp-3d-published",
        "aanap-published",
        "straightening",
        "homography",
        "autostitch",
        "apap",
        "sphp",
        "sphp-free",
        "aanap",
        "quasi-homography",
    ]
    """How the panorama's shape is found. Choose another one to compare, or for photographs that it serves better
    (default vpg)."""
    align: Literal["auto", "points", "lines", "photometric", "lines+photometric"]
    """What draws overlapping photographs together. Where things stand twice or lines break at seams, take more than
    auto does: it is slower and shows fewer ghosts (default auto)."""
    structure: Literal["none", "lines"]
    """What of the photographs' structure is kept, beyond the neighborhoods of grid vertices. Choose lines where long
    edges bend (default none)."""
    seed: int
    """Every random choice, from the verification of pairs on, derives from this number. Change it to see how much of a
    result is chance (default 0)."""
    memory: str
    """Memory that the work may take; auto is a quarter of the machine's, or more where less is too little. With less,
    the canvas goes to a scratch file and photographs are decoded again. Set it where other programs need theirs
    (default auto)."""
    scratch: str
    """Folder for the scratch file; empty for the folder of the panorama. Set it where that disk is slow or full."""
    threads: int
    """Number of threads; 0 for one per core. The panorama is the same for any number."""
