"""What the endpoints do, over HTTP."""

from __future__ import annotations

import io
import json
import subprocess
import zipfile
from pathlib import Path
from urllib.parse import urlencode

import anchorsplat
import pytest
from anchorsplat._program import program

from .service import Server, small_ply

SPLAT = small_ply()


def result(server: Server, job: dict, **query: str) -> bytes:
    answer = server.http.get(job["links"]["result"], params=query)
    assert answer.status_code == 200, answer.text
    return answer.content


def test_an_enhanced_splat_in_every_format(server: Server) -> None:
    job = server.submit(SPLAT, name="../etc/my scan.ply", quality="fast", upscale=2)
    assert job["name"] == "my scan.ply"
    done = server.wait(job)
    assert done["state"] == "done", done
    assert done["input"] == {"format": "PLY", "gaussians": 60, "bytes": len(SPLAT), "sh_degree": 0, "cameras": False}
    assert done["options"]["upscale"] == 2
    assert "60 Gaussians in" in done["report"]["sentences"][0]
    gaussians = done["report"]["details"]["gaussians"]["out"]
    assert len(anchorsplat.read(result(server, done))) == gaussians
    for format in done["formats"]:
        answer = server.http.get(done["links"]["result"], params={"format": format})
        assert answer.status_code == 200, (format, answer.text)
        assert f"my%20scan-2x.{format}" in answer.headers["content-disposition"]
        if format in ("compressed.ply", "spz", "sog", "glb"):
            assert len(anchorsplat.read(answer.content)) == gaussians, format
    archive = zipfile.ZipFile(io.BytesIO(result(server, done, format="gltf")))
    assert sorted(archive.namelist()) == ["result.bin", "result.gltf"]


def test_the_same_bits_as_the_command_line(server: Server, tmp_path: Path) -> None:
    done = server.wait(server.submit(SPLAT, upscale=8))
    (tmp_path / "in.ply").write_bytes(SPLAT)
    subprocess.run(
        [program(), "enhance", tmp_path / "in.ply", "-o", tmp_path / "out.ply", "--upscale", "8", "-q"], check=True
    )
    assert result(server, done) == (tmp_path / "out.ply").read_bytes()


def test_a_region_within_a_budget(server: Server) -> None:
    before = anchorsplat.read(SPLAT).means
    inside = (before[:, 2] >= 0).sum()  # of the unit sphere: its upper half
    done = server.wait(server.submit(SPLAT, region="-2,-2,0,2,2,2", max_gaussians=len(before) + 5))
    assert done["state"] == "done", done
    kept = len(before) - inside
    assert done["report"]["details"]["region"] == {"gaussians": inside, "kept_outside": kept}
    assert any(f"{kept} outside of it stay" in sentence for sentence in done["report"]["sentences"])
    after = anchorsplat.read(result(server, done)).means
    assert len(after) <= len(before) + 5
    assert (after[len(after) - kept :] == before[before[:, 2] < 0]).all()
    nothing = server.wait(server.submit(SPLAT, region="9,9,9,1"))
    assert nothing["state"] == "failed" and "no Gaussian lies in it" in nothing["error"]["message"]


def test_the_same_wish_is_answered_from_what_is_there(server: Server) -> None:
    first = server.wait(server.submit(SPLAT, upscale=3))
    again = server.http.post("/v1/enhance?upscale=3.0&quality=fast", files={"file": ("other.ply", SPLAT)})
    assert again.status_code == 200
    assert again.json()["state"] == "done" and again.json()["id"] != first["id"]
    other = server.http.post("/v1/enhance", params={"upscale": 3.5}, files={"file": ("other.ply", SPLAT)})
    assert other.status_code == 202
    server.wait(other.json())


def test_a_raw_body(server: Server) -> None:
    answer = server.http.post("/v1/convert?to=splat&name=scan.ply", content=SPLAT)
    assert answer.status_code == 202
    splat = result(server, server.wait(answer.json()))
    assert len(splat) == 60 * 32
    curl = {"content-type": "application/x-www-form-urlencoded"}  # of --data-binary, whatever the data
    same = server.http.post("/v1/convert?to=splat&name=scan.ply", content=SPLAT, headers=curl)
    assert result(server, server.wait(same.json())) == splat
    # A .splat can be told by its name only.
    assert server.http.post("/v1/convert?to=ply", content=splat).status_code == 400
    named = server.http.post("/v1/convert?to=ply&name=scan.splat", content=splat)
    assert len(anchorsplat.read(result(server, server.wait(named.json())))) == 60
    enhanced = server.wait(server.submit(splat, name="scan.SPLAT"))
    assert enhanced["state"] == "done" and enhanced["input"]["format"] == "splat"
    assert server.http.get(enhanced["links"]["view"]).status_code == 200


def test_converting(server: Server) -> None:
    done = server.wait(server.submit(SPLAT, "convert", to="spz", max_gaussians=10))
    assert done["formats"] == ["spz"]
    assert len(anchorsplat.read(result(server, done))) == 10
    assert server.http.get(done["links"]["result"], params={"format": "ply"}).status_code == 422
    table = server.wait(server.submit(SPLAT, "convert", to="csv"))
    assert result(server, table).count(b"\n") == 61
    assert "view" not in table["links"]
    assert server.http.get(f"{table['links']['self']}/view").status_code == 409


def test_edits_are_the_command_lines_in_their_order(server: Server, tmp_path: Path) -> None:
    (tmp_path / "in.ply").write_bytes(SPLAT)
    edits = [
        ("rotate", "10,20,30"),
        ("filter_sphere", "0.5,0,0,1"),
        ("translate", "-1,0,0"),
        ("filter-nan", ""),
        ("translate", "0,2,0"),
        ("filter_value", "opacity,gt,0.6"),
    ]
    words = [f"--{name.replace('_', '-')}" + (f"={value}" if value else "") for name, value in edits]
    for axes in ([], ["--action-axes=RDF"]):
        query = urlencode([("to", "ply"), *edits, *(("action_axes", "RDF") for _ in axes)])  # httpx puts equal names together
        answer = server.http.post(f"/v1/convert?{query}", content=SPLAT)
        done = server.wait(answer.json())
        assert done["state"] == "done", done
        subprocess.run(
            [program(), "convert", tmp_path / "in.ply", tmp_path / "out.ply", "-w", "-q", *words, *axes], check=True
        )
        assert result(server, done) == (tmp_path / "out.ply").read_bytes()
        steps = done["report"]["details"]["actions"]
        assert [step["action"].split()[0] for step in steps] == [word.split("=")[0] for word in words]
        said = " ".join(done["report"]["sentences"])
        assert f"--filter-sphere 0.5,0,0,1: {steps[1]['taken']} taken away, {steps[1]['left']} left." in said
        assert f"along {'RDF' if axes else 'LUF'}" in said
    # Another order is another wish.
    other = server.http.post(f"/v1/convert?{urlencode([('to', 'ply'), edits[1], edits[0], *edits[2:]])}", content=SPLAT)
    assert other.status_code == 202
    assert result(server, server.wait(other.json())) != (tmp_path / "out.ply").read_bytes()
    form = {"to": "ply", "mirror": "x", "filter-harmonics": "0"}
    mirrored = server.http.post("/v1/convert", data=form, files={"file": ("a.ply", SPLAT)})
    assert server.wait(mirrored.json())["options"]["edits"] == [["mirror", "x"], ["filter_harmonics", "0"]]


@pytest.mark.parametrize(
    "edits, says",
    [
        ({"translate": "1,2"}, "--translate: expected X,Y,Z, found '1,2'"),
        ({"translate": "1,2,3 -o x"}, "expected X,Y,Z"),
        ({"translate": "1,2,1e999"}, "expected X,Y,Z"),
        ({"scale": "1,2,3"}, "one factor for all axes"),
        ({"scale": "-1"}, "--mirror mirrors"),
        ({"filter_nan": "banana"}, "takes no value"),
        ({"filter_value": "x\0y,gt,1"}, "control characters"),
        ({"filter_value": "opacity,gt,1\n"}, "control characters"),
        ({"filter_floaters": "0"}, "one factor above 0"),
        ({"mirror": ""}, "an axis"),
        ({"action_axes": "LUF"}, "has an effect only with edits"),
        ({"action_axes": "XYZ", "translate": "1,2,3"}, "is not a set of axes"),
        ({"edits": "translate"}, "edits"),
        ({"edits": "translate", "translate": "1,2,3"}, "its own name"),
        ({"dry_run": "true"}, "dry_run"),
        ([("scale", "2")] * 65, "edits"),
    ],
)
def test_edits_that_make_no_sense(server: Server, edits: dict, says: str) -> None:
    answer = server.http.post("/v1/convert", params=edits, content=SPLAT)
    assert answer.status_code == 422, answer.text
    assert answer.json()["error"]["code"] == "bad_option" and says in answer.json()["error"]["message"]
    assert server.http.post("/v1/render", params={"scale": "2"}, content=SPLAT).status_code == 422


def test_edits_that_this_splat_refuses(server: Server) -> None:
    for query, says in (
        ({"filter_sphere": "90,0,0,1"}, "removes the last 60 Gaussians"),
        ({"filter_value": "label,gt,1"}, "splat: --filter-value label,gt,1: there is no property 'label'"),
    ):
        failed = server.wait(server.http.post("/v1/convert", params=query, content=SPLAT).json())
        assert failed["state"] == "failed" and failed["error"]["code"] == "bad_option"
        assert says in failed["error"]["message"]


def test_rendering(server: Server) -> None:
    one = server.wait(server.submit(SPLAT, "render", size="64x48", up="-z"))
    assert result(server, one).startswith(b"\x89PNG")
    several = server.wait(server.submit(SPLAT, "render", orbit=3, size="32x32", background="1,1,1"))
    archive = zipfile.ZipFile(io.BytesIO(result(server, several)))
    assert len(archive.namelist()) == 3 and archive.read(archive.namelist()[0]).startswith(b"\x89PNG")


def test_training_cameras(server: Server) -> None:
    frame = {"file_path": "/etc/passwd", "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]}
    lens = {"w": 64, "h": 64, "fl_x": 60.0}

    def send(cameras: object, **options: str):
        files = {"file": ("a.ply", SPLAT), "cameras": ("transforms.json", json.dumps(cameras))}
        return server.http.post("/v1/enhance", files=files, data=options)

    done = server.wait(send(lens | {"frames": [frame]}).json())
    assert done["state"] == "done" and done["input"]["cameras"]
    assert "that of the cameras" in " ".join(done["report"]["sentences"])
    assert done["report"]["details"]["pixel_size"]["source"] == "cameras"
    missing = send({"fl_x": 60.0, "frames": [frame]})
    assert missing.status_code == 400 and "pictures are not here" in missing.json()["error"]["message"]
    assert send([]).status_code == 400


def test_the_page_of_a_result(server: Server) -> None:
    done = server.wait(server.submit(SPLAT))
    page = server.http.get(done["links"]["view"])
    assert page.headers["content-type"].startswith("text/html") and 'id="before-0"' in page.text
    policy = page.headers["content-security-policy"]
    assert (
        policy.startswith("sandbox allow-scripts;")
        and "allow-same-origin" not in policy
        and "connect-src" not in policy
    )


@pytest.mark.parametrize(
    "options, says",
    [
        ({"colour": "red"}, "colour"),
        ({"upscale": "0.5"}, "upscale"),
        ({"upscale": "nan"}, "upscale"),
        ({"quality": "best"}, "quality"),
        ({"output": "/etc/passwd"}, "output"),
        ({"model": "/etc/passwd"}, "model"),
        ({"background": "1,1,1"}, "clean"),
        ({"background": "1,1,1 -o x", "clean": "true"}, "background"),
        ({"train_width": "64"}, "cameras"),
        ({"pixel_size": "-1"}, "pixel_size"),
        ({"region": "0,0,0"}, "region"),
        ({"region": "0,0,0,1,1"}, "region"),
        ({"region": "0,0,0,nan"}, "region"),
        ({"region": "0,0,0,1 -o x"}, "region"),
        ({"region": "0,0,0,1\n"}, "region"),
        ({"max_gaussians": "-1"}, "max_gaussians"),
    ],
)
def test_options_that_make_no_sense(server: Server, options: dict, says: str) -> None:
    for answer in (
        server.http.post("/v1/enhance", params=options, content=SPLAT),
        server.http.post("/v1/enhance", data=options, files={"file": ("a.ply", SPLAT)}),
    ):
        assert answer.status_code == 422, answer.text
        assert answer.json()["error"]["code"] == "bad_option" and says in answer.json()["error"]["message"]


def test_options_said_twice(server: Server) -> None:
    answer = server.http.post("/v1/enhance?upscale=2&upscale=3", content=SPLAT)
    assert answer.status_code == 422 and "more than once" in answer.text
    both = server.http.post("/v1/enhance?upscale=2", data={"upscale": "2"}, files={"file": ("a.ply", SPLAT)})
    assert both.status_code == 422


def test_what_is_not_there(server: Server) -> None:
    for path in (
        "/v1/jobs/none",
        "/v1/jobs/none/result",
        "/v1/jobs/none/view",
        "/v1/jobs/none/events",
        "/none",
        "/static/none",
    ):
        answer = server.http.get(path)
        assert answer.status_code == 404 and answer.json()["error"]["code"] == "not_found", path
    assert server.http.delete("/v1/jobs/none").status_code == 404
    assert server.http.get("/v1/enhance").status_code == 405


def test_forgetting_a_job(server: Server) -> None:
    done = server.wait(server.submit(SPLAT, upscale=5))
    twin = server.submit(SPLAT, upscale=5)
    assert server.http.delete(done["links"]["self"]).status_code == 204
    assert server.http.get(done["links"]["self"]).status_code == 404
    assert server.http.get(f"{twin['links']['self']}/result").status_code == 200  # somebody else's is still there
    assert server.http.delete(twin["links"]["self"]).status_code == 204
    assert server.http.post("/v1/enhance", params={"upscale": 5}, content=SPLAT).status_code == 202


def test_what_the_service_says_about_itself(server: Server) -> None:
    assert server.http.get("/healthz").json() == {"status": "ok"}
    limits = server.http.get("/v1/limits").json()
    assert limits["version"] == anchorsplat.__version__ and "spz" in limits["formats"]
    server.wait(server.submit(SPLAT))
    metrics = server.http.get("/metrics").text
    for name in (
        "anchorsplat_jobs_total",
        "anchorsplat_queued",
        "anchorsplat_stored_bytes",
        "process_resident_memory_bytes",
    ):
        assert f"\n{name}" in metrics
    described = server.http.get("/openapi.json").json()
    assert {"/v1/enhance", "/v1/convert", "/v1/render", "/v1/jobs/{job_id}/result"} <= set(described["paths"])
    enhance = described["paths"]["/v1/enhance"]["post"]
    assert {"quality", "upscale", "copies"} <= {p["name"] for p in enhance["parameters"]}
    assert "cameras" in enhance["requestBody"]["content"]["multipart/form-data"]["schema"]["properties"]
