"""Batches of splats: results, what is done again and what is not, and what goes wrong."""

from __future__ import annotations

import json
import os
import socket
from pathlib import Path

import fsspec
import pytest

from anchorsplat import batch
from anchorsplat._errors import BadArgumentError, ExistsError, IoError, NotFoundError
from anchorsplat.batch.enhance import How
from anchorsplat.batch.settings import settings_of

from .conftest import Control, enhanced_by_hand, splat


def rows(manifest: str | Path) -> list[dict]:
    """Rows about results, in the order they were written."""
    return [line for line in map(json.loads, Path(manifest).read_text().splitlines()) if "output" in line]


def test_results_are_the_programs_own(control: Control, scans: Path, tmp_path: Path, native: Path) -> None:
    out = tmp_path / "out"
    report = batch.enhance(f"{scans}/*.ply", out, upscale=3, pixel_size=0.05, format="spz")
    assert (report.total, report.done, report.failed, report.skipped) == (4, 4, 0, 0)
    assert report.exit_code == 0 and report.gaussians_in == 160
    for name in "abcd":
        by_hand = enhanced_by_hand(native, scans / f"{name}.ply", tmp_path / f"{name}.spz", "--upscale=3", "--pixel-size=0.05")
        assert (out / f"{name}.spz").read_bytes() == by_hand
    assert sorted(path.name for path in out.iterdir()) == ["a.spz", "b.spz", "c.spz", "d.spz", "manifest.jsonl"]
    row = next(row for row in rows(report.manifest) if row["output"] == "b.spz")
    assert row["input"] == str(scans / "b.ply") and row["state"] == "done"
    assert row["options"] == ["--pixel-size=0.05", "--upscale=3"] and row["pixel_size"]["source"] == "given"
    assert row["size"] == (scans / "b.ply").stat().st_size and row["output_size"] == (out / "b.spz").stat().st_size
    assert row["gaussians"]["in"] == 40 and row["engine"] and len(row["sha256"]) == 64


def test_again_makes_only_what_is_missing_or_changed(control: Control, scans: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"

    def again(**how: object) -> tuple[list[str], int]:
        report = batch.enhance(f"{scans}/*.ply", out, **{"method": "filter", **how})
        assert report.done + report.skipped == 4
        return control.calls(), report.skipped

    everything = [f"{name}.ply" for name in "abcd"]
    assert again() == (everything, 0)
    assert again() == ([], 4)
    os.utime(scans / "a.ply", ns=(1, 1))  # the same bytes of another time
    assert again() == ([], 4)
    (out / "b.ply").unlink()
    assert again() == (["b.ply"], 3)
    (out / "b.ply").write_bytes(b"short")
    assert again() == (["b.ply"], 3)
    splat(scans / "c.ply", seed=99)
    assert again() == (["c.ply"], 3)
    assert again(upscale=2) == (everything, 0)
    assert again(upscale=2) == ([], 4)
    whole = (out / "d.ply").read_bytes()
    (out / "d.ply").write_bytes(whole[:-1] + b"?")  # the size that it should have
    assert again(upscale=2) == ([], 4)
    assert again(upscale=2, verify=True) == (["d.ply"], 3)
    assert (out / "d.ply").read_bytes() == whole
    assert again(upscale=2, overwrite=True) == (everything, 0)


def test_a_bad_file_is_a_row(control: Control, scans: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (scans / "b.ply").write_bytes(b"no splat")
    listed = tmp_path / "list.txt"
    listed.write_text(f"{scans}/*.ply\n{scans}/gone.ply\n")
    code = batch.main(["enhance", "--list", str(listed), "-o", str(tmp_path / "out"), "--method", "filter"])
    said = capfd.readouterr()
    assert code == 1
    assert "5 splats: 3 enhanced, 0 there already, 2 failed" in said.out
    assert f"error: {scans}/b.ply: byte 0: is not a PLY file" in said.err
    assert f"error: {scans}/gone.ply: no such file" in said.err
    failed = {row["output"]: row["error"]["code"] for row in rows(tmp_path / "out/manifest.jsonl") if row["state"] == "failed"}
    assert failed == {"b.ply": "bad_file", "gone.ply": "not_found"}
    splat(scans / "b.ply", 7)  # mended, it is made
    assert batch.enhance(f"{scans}/*.ply", tmp_path / "out", method="filter").done == 1


def test_where_nothing_can_be_done_the_code_says_why(control: Control, tmp_path: Path) -> None:
    bad = tmp_path / "bad.ply"
    bad.write_bytes(b"no splat")
    assert batch.main(["enhance", str(bad), "-o", str(tmp_path / "out"), "-q"]) == 4
    assert batch.main(["enhance", str(tmp_path / "gone.ply"), "-o", str(tmp_path / "out"), "-q"]) == 3


def test_json(control: Control, scans: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = ["enhance", f"{scans}/*.ply", "-o", str(tmp_path / "out"), "--method", "filter", "--json"]
    assert batch.main(words) == 0
    told = json.loads(capfd.readouterr().out)
    assert told["done"] == 4 and told["exit_code"] == 0 and told["manifest"] == str(tmp_path / "out/manifest.jsonl")
    assert batch.main([*words, "--upscale", "0"]) == 2
    assert json.loads(capfd.readouterr().out)["error"]["code"] == "bad_argument"


def test_the_splat_of_a_killed_worker_is_done_by_another(control: Control, scans: Path, tmp_path: Path, native: Path) -> None:
    control.kill_worker_of("b.ply")
    report = batch.enhance(f"{scans}/*.ply", tmp_path / "out", method="filter")
    assert (report.done, report.failed) == (4, 0)
    assert control.calls() == ["a.ply", "b.ply", "b.ply", "c.ply", "d.ply"]  # what was finished is not done twice
    written = rows(report.manifest)
    assert sorted(row["output"] for row in written) == ["a.ply", "b.ply", "c.ply", "d.ply"]
    for name in "abcd":
        by_hand = enhanced_by_hand(native, scans / f"{name}.ply", tmp_path / f"{name}.ply", "--method=filter")
        assert (tmp_path / "out" / f"{name}.ply").read_bytes() == by_hand
    assert not (tmp_path / "out/.batch").exists()


def test_a_splat_that_kills_every_worker_is_a_row(control: Control, scans: Path, tmp_path: Path) -> None:
    control.kill_worker_of("c.ply", always=True)
    report = batch.enhance(f"{scans}/*.ply", tmp_path / "out", method="filter", retries=1)
    assert (report.done, report.failed) == (3, 1)
    assert report.failures[0]["output"] == "c.ply" and report.failures[0]["error"]["code"] == "worker_died"
    assert control.calls().count("c.ply") == 2


def test_a_killed_program_is_started_again(control: Control, scans: Path, tmp_path: Path) -> None:
    control.kill_program_of("b.ply")
    control.kill_program_of("c.ply", always=True)
    report = batch.enhance(f"{scans}/*.ply", tmp_path / "out", method="filter", retries=1)
    assert (report.done, report.failed) == (3, 1)
    assert report.failures[0]["output"] == "c.ply" and report.failures[0]["error"]["code"] == "killed"
    assert control.calls() == ["a.ply", "b.ply", "b.ply", "c.ply", "c.ply", "d.ply"]


def test_keywords_are_those_of_the_function_for_one(control: Control, scans: Path, tmp_path: Path, native: Path) -> None:
    report = batch.enhance(scans / "a.ply", tmp_path / "out", method="filter", clean=True, background=(1, 1, 1))
    assert report.done == 1
    by_hand = enhanced_by_hand(native, scans / "a.ply", tmp_path / "a.ply", "--method=filter", "--clean", "--background=1,1,1")
    assert (tmp_path / "out/a.ply").read_bytes() == by_hand
    with pytest.raises(BadArgumentError, match="cameras: expected a file or folder"):
        batch.enhance(scans / "a.ply", tmp_path / "two", cameras=object())


def test_a_region_within_a_budget(control: Control, scans: Path, tmp_path: Path, native: Path) -> None:
    report = batch.enhance(scans / "a.ply", tmp_path / "out", region=(-1, -1, -1, 0, 1, 1), max_gaussians=45)
    assert report.done == 1
    row = rows(report.manifest)[-1]
    assert row["gaussians"]["out"] <= 45 and row["options"] == ["--max-gaussians=45", "--region=-1,-1,-1,0,1,1"]
    by_hand = enhanced_by_hand(native, scans / "a.ply", tmp_path / "a.ply", "--region=-1,-1,-1,0,1,1", "--max-gaussians=45")
    assert (tmp_path / "out/a.ply").read_bytes() == by_hand
    words = ["enhance", str(scans / "a.ply"), "--out", str(tmp_path / "told"), "--most-gaussians", "45", "--region=-1,-1,-1,0,1,1"]
    assert batch.main([*words, "--quiet"]) == 0  # its old name
    assert (tmp_path / "told/a.ply").read_bytes() == by_hand
    with pytest.raises(BadArgumentError, match="region: '0,0,0,-1' is neither a box"):
        batch.enhance(scans / "a.ply", tmp_path / "two", region=(0, 0, 0, -1))


def test_a_pipe_is_a_row(control: Control, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.ply")
    report = batch.enhance(tmp_path / "pipe.ply", tmp_path / "out")
    assert "is no file" in report.failures[0]["error"]["message"]


class StopsAfter:
    """A progress bar at which somebody presses Ctrl-C."""

    def __init__(self, count: int) -> None:
        self.n, self.total, self._count = 0, 0, count

    def update(self, step: int) -> None:
        self.n += step
        if self.n == self._count:
            raise KeyboardInterrupt


def test_interrupted_it_goes_on_where_it_was(control: Control, scans: Path, tmp_path: Path) -> None:
    pipe = control.hold("d.ply")
    with pytest.raises(batch.Stopped):
        batch.enhance(f"{scans}/*.ply", tmp_path / "out", method="filter", progress=StopsAfter(3))
    before = control.calls()
    assert [name for name in before if name != "d.ply"] == ["a.ply", "b.ply", "c.ply"]
    assert not (tmp_path / "out/d.ply").exists() and not (tmp_path / "out/.batch").exists()
    pipe.unlink()
    report = batch.enhance(f"{scans}/*.ply", tmp_path / "out", method="filter")
    assert (report.done, report.skipped) == (1, 3) and control.calls() == ["d.ply"]


def test_files_of_others_are_not_replaced(control: Control, scans: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out/b.ply").write_text("mine")
    with pytest.raises(ExistsError, match=r"out/b\.ply: exists, but was not made by a batch"):
        batch.enhance(f"{scans}/*.ply", tmp_path / "out", method="filter")
    assert control.calls() == [] and (tmp_path / "out/b.ply").read_text() == "mine"
    with pytest.raises(BadArgumentError, match="its result would replace it"):
        batch.enhance(f"{scans}/a.ply", scans, method="filter", overwrite=True)
    assert batch.enhance(f"{scans}/*.ply", tmp_path / "out", method="filter", overwrite=True).done == 4


def test_what_a_killed_batch_left_is_its_own(control: Control, scans: Path, tmp_path: Path) -> None:
    """Results whose row was not written any more."""
    out = tmp_path / "out"
    batch.enhance(f"{scans}/*.ply", out, method="filter")
    manifest = out / "manifest.jsonl"
    lines = manifest.read_text().splitlines(keepends=True)
    manifest.write_text("".join(lines[:3]) + lines[3][:40])
    control.calls()
    report = batch.enhance(f"{scans}/*.ply", out, method="filter")
    assert (report.done, report.skipped) == (2, 2) and len(control.calls()) == 2


def test_files_that_options_name(control: Control, scans: Path, tmp_path: Path) -> None:
    camera = {"camera_model": "PINHOLE", "w": 64, "h": 64, "fl_x": 60, "fl_y": 60, "cx": 32, "cy": 32}
    pose = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]]
    for name in "abd":
        text = json.dumps({**camera, "frames": [{"file_path": "0.png", "transform_matrix": pose}]})
        (scans / f"{name}.json").write_text(text)
    how = {"cameras": "{folder}/{stem}.json", "method": "filter"}
    report = batch.enhance(f"{scans}/*.ply", tmp_path / "out", **how)
    assert (report.done, report.failed) == (3, 1)
    assert report.failures[0]["output"] == "c.ply" and "c.json: no such file" in report.failures[0]["error"]["message"]
    assert {row["pixel_size"]["source"] for row in rows(report.manifest) if row["state"] == "done"} == {"cameras"}
    control.calls()
    (scans / "b.json").write_text((scans / "b.json").read_text().replace("60", "50"))
    batch.enhance(f"{scans}/[abd].ply", tmp_path / "out", **how)
    assert control.calls() == ["b.ply"]
    shared = {"cameras": str(scans / "a.json"), "train_width": 32, "camera_rule": "median", "method": "filter"}
    assert batch.enhance(f"{scans}/*.ply", tmp_path / "shared", **shared).done == 4
    with pytest.raises(BadArgumentError, match="upscale 0.5 must be at least 1"):
        batch.enhance(f"{scans}/*.ply", tmp_path / "no", **{**shared, "upscale": 0.5})
    with pytest.raises(BadArgumentError, match="only {folder}, {stem} and {name}"):
        batch.enhance(f"{scans}/*.ply", tmp_path / "out", cameras="{home}/x.json")
    with pytest.raises(NotFoundError, match="none.safetensors: no such file"):
        batch.enhance(f"{scans}/*.ply", tmp_path / "out", model=f"{tmp_path}/none.safetensors")


def test_what_makes_no_sense_is_said_before_any_work(control: Control, scans: Path, tmp_path: Path) -> None:
    def refused(because: str, **how: object) -> None:
        with pytest.raises(BadArgumentError, match=because):
            batch.enhance(f"{scans}/*.ply", tmp_path / "out", **how)

    refused("--upscale 0.5 must be at least 1", upscale=0.5)
    refused("--steps has no effect with --method model", method="model", steps=5)
    refused("unknown method 'nope'", method="nope")
    refused("output: enhance has no such option for batches", output="x.ply")
    refused("clean='yes': expected True or False", clean="yes")
    refused("--format gltf", format="gltf")
    refused("--threads 0: must be at least 1", threads=0)
    refused("no machine here has more than 2 cores", threads=64)
    refused("ray job submit", ray="ray://127.0.0.1:1")
    assert control.calls() == [] and not list((tmp_path / "out").glob("*.ply"))


def test_names_that_are_no_text(control: Control, tmp_path: Path) -> None:
    splat(Path(os.fsdecode(os.fsencode(tmp_path / "in") + b"\xff.ply")))
    for skipped in (0, 1):
        report = batch.enhance(f"{tmp_path}/in*.ply", tmp_path / "out", method="filter")
        assert (report.failed, report.skipped) == (0, skipped)


def test_progress_as_a_class_and_as_a_function(control: Control, scans: Path, tmp_path: Path) -> None:
    bars: list[Bar] = []

    class Bar:
        def __init__(self, total: int, desc: str):
            self.n, self.total, self.closed = 0, total, False
            bars.append(self)

        def update(self, more: int) -> None:
            self.n += more

        def close(self) -> None:
            self.closed = True

    batch.enhance(f"{scans}/*.ply", tmp_path / "out", method="filter", progress=Bar)
    assert [(bar.n, bar.total, bar.closed) for bar in bars] == [(4, 4, True)]
    seen: list[tuple] = []
    batch.enhance(f"{scans}/*.ply", tmp_path / "again", method="filter", progress=seen.append)
    assert seen[-1] == ("batch", 4, 4, "", True)


def test_a_cluster_that_is_not_there(scans: Path, tmp_path: Path) -> None:
    with socket.socket() as taken:  # bound, and nobody listens
        taken.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(IoError, match=f"no Ray cluster at {address}"):
            batch.enhance(f"{scans}/*.ply", tmp_path / "out", method="filter", ray=address)


def test_memory_file_system(control: Control, scans: Path, tmp_path: Path, native: Path) -> None:
    """What only the driver has travels with the tasks."""
    for name in "ab":
        with fsspec.open(f"memory://scans-{tmp_path.name}/{name}.ply", "wb") as file:
            file.write((scans / f"{name}.ply").read_bytes())
    words = (f"memory://scans-{tmp_path.name}/*.ply", f"memory://sharp-{tmp_path.name}")
    report = batch.enhance(*words, method="filter", format="spz")
    assert report.done == 2
    with fsspec.open(f"memory://sharp-{tmp_path.name}/a.spz", "rb") as file:
        assert file.read() == enhanced_by_hand(native, scans / "a.ply", tmp_path / "a.spz", "--method=filter")
    assert batch.enhance(*words, method="filter", format="spz").skipped == 2


def test_an_input_that_changes_while_it_is_read_is_a_row(control: Control, scans: Path, tmp_path: Path) -> None:
    from anchorsplat.batch.task import enhance_one

    settings = settings_of({"--method": "filter"}, None, local_target=True)
    run = batch.enhance.__globals__["run_splats"].__globals__["SplatBatch"](str(tmp_path / "out"), None, settings, How())
    (job,) = run.plan(run_inputs(scans / "a.ply"), overwrite=False, verify=False)
    os.utime(scans / "a.ply", ns=(1, 1))
    row = enhance_one(job)
    run.manifest.close()
    assert row["error"]["code"] == "changed" and not (tmp_path / "out/a.ply").exists()


def run_inputs(*paths: Path) -> list:
    from anchorsplat.batch.inputs import expand

    return expand(map(str, paths))


def test_nothing_listens_beyond_this_machine(ray: object) -> None:
    """Every socket that a process of this Ray listens on is bound to 127.0.0.1."""
    sockets = set()
    for process in descendants(os.getpid()):
        for descriptor in Path(f"/proc/{process}/fd").iterdir():
            try:
                target = os.readlink(descriptor)
            except OSError:
                continue
            if target.startswith("socket:["):
                sockets.add(target[8:-1])
    listening = []
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == "0A" and fields[9] in sockets:
                address = bytes.fromhex(fields[1].split(":")[0])[-4:][::-1]  # the last four bytes: of a mapped address, too
                listening.append(socket.inet_ntoa(address))
    assert listening and set(listening) == {"127.0.0.1"}


def descendants(pid: int) -> list[int]:
    children: dict[int, list[int]] = {}
    for process in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((process / "stat").read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
        children.setdefault(parent, []).append(int(process.name))
    found, new = [pid], [pid]
    while new:
        new = [child for parent in new for child in children.get(parent, [])]
        found += new
    return found
