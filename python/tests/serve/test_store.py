"""What is kept, for how long, and what a start finds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from anchorsplat.serve import store as states
from anchorsplat.serve.options import ConvertOptions, EnhanceOptions
from anchorsplat.serve.store import DataInUse, Store

DAY = 86400.0


class Clock:
    now = 1e9

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def open_store(tmp_path: Path, clock: Clock) -> Iterator[Callable[[], Store]]:
    """Opens the folder of the test, after whoever had it has gone."""
    opened: list[Store] = []

    def open_again() -> Store:
        for store in opened:
            store.close()
        opened.append(Store(tmp_path, clock))
        return opened[-1]

    yield open_again
    for store in opened:
        store.close()


def add(store: Store, number: int, size: int = 100) -> str:
    """An input with a job of its own; the key of its work."""
    upload = store.new_upload()
    upload.write_bytes(bytes(size))
    store.add_input(upload, f"input{number}", {"gaussians": 1})
    return store.job(store.add_job("convert", "{}", f"input{number}", None, "build", "a.ply"))["key"]


def finish(store: Store, key: str, size: int = 100) -> None:
    assert store.next_work()["key"] == key
    store.work_folder(key).mkdir()
    (store.work_folder(key) / "result.spz").write_bytes(bytes(size))
    store.finish(key, {})


def test_results_go_by_age(open_store, tmp_path: Path, clock: Clock) -> None:
    store = open_store()
    old, new = add(store, 1), add(store, 2)
    finish(store, old)
    clock.now += 5 * DAY
    finish(store, new)
    clock.now += 3 * DAY
    assert store.sweep(7, 10**9) == 1
    assert store.work(old) is None and store.work(new)["state"] == states.DONE
    assert not store.result_folder(old).exists() and not store.input_path("input1").exists()
    assert store.result_folder(new).exists() and store.input_path("input2").exists()


def test_being_asked_for_keeps_a_result(open_store, tmp_path: Path, clock: Clock) -> None:
    store = open_store()
    first, second = add(store, 1), add(store, 2)
    finish(store, first)
    clock.now += 1
    finish(store, second)
    clock.now += 1
    store.touch(first)
    clock.now += 100
    assert store.stored_bytes() == 400
    assert store.sweep(7, 200) == 1
    assert store.work(first) is not None and store.work(second) is None


def test_what_waits_or_runs_stays(open_store, tmp_path: Path, clock: Clock) -> None:
    store = open_store()
    running, waiting = add(store, 1), add(store, 2)
    assert store.next_work()["key"] == running
    clock.now += 100 * DAY
    assert store.sweep(7, 1) == 0
    assert store.work(waiting)["state"] == states.QUEUED and store.input_path("input1").exists()


def test_what_a_killed_service_leaves(open_store, tmp_path: Path, clock: Clock) -> None:
    store = open_store()
    ran, done = add(store, 1), add(store, 2)
    assert store.next_work()["key"] == ran
    store.work_folder(ran).mkdir()
    finish(store, done)
    (tmp_path / "uploads" / "half").write_bytes(b"x")
    (tmp_path / "work" / "other").mkdir()
    (tmp_path / "results" / "half").mkdir()
    (tmp_path / "inputs" / "nobodys").write_bytes(b"x")
    store = open_store()
    assert store.work(ran)["state"] == states.QUEUED and store.work(done)["state"] == states.DONE
    assert [p.name for p in (tmp_path / "results").iterdir()] == [done]
    assert [p.name for p in (tmp_path / "work").iterdir()] == [ran]  # it may hold a state to go on from
    assert not list((tmp_path / "uploads").iterdir())
    assert sorted(p.name for p in (tmp_path / "inputs").iterdir()) == ["input1", "input2"]


def test_a_folder_is_one_services(tmp_path: Path) -> None:
    store = Store(tmp_path)
    with pytest.raises(DataInUse, match="another 'anchorsplat serve'"):
        Store(tmp_path)
    store.close()
    Store(tmp_path).close()


def test_a_start_clears_away_what_a_kill_left(tmp_path: Path) -> None:
    """Whatever stands where: a service that does not start again has lost all."""
    Store(tmp_path).close()
    for place in ("uploads", "inputs", "results", "work"):
        (tmp_path / place / "0123.check" / "deeper").mkdir(parents=True)
        (tmp_path / place / "stray").write_text("x")
    Store(tmp_path).close()
    for place in ("uploads", "inputs", "results", "work"):
        assert list((tmp_path / place).iterdir()) == []


def test_a_damaged_list_of_jobs_has_a_sentence(tmp_path: Path) -> None:
    Store(tmp_path).close()
    (tmp_path / "jobs.sqlite3").write_bytes(b"no data base " * 100)
    with pytest.raises(DataInUse, match=r"jobs\.sqlite3: cannot be read .* --data"):
        Store(tmp_path)


def test_oldest_first(open_store, tmp_path: Path, clock: Clock) -> None:
    store = open_store()
    keys = []
    for number in range(5):
        clock.now += 1
        keys.append(add(store, number))
    assert [store.position(store.work(key)) for key in keys] == [1, 2, 3, 4, 5]
    assert [store.next_work()["key"] for _ in keys] == keys
    assert store.next_work() is None


def test_the_same_wish_has_the_same_words() -> None:
    same = [
        EnhanceOptions(),
        EnhanceOptions.model_validate({"upscale": "4"}),
        EnhanceOptions(quality="fast", pixel_size="auto"),
    ]
    assert len({options.canonical() for options in same}) == 1
    assert EnhanceOptions(upscale=4.5).canonical() not in {options.canonical() for options in same}
    assert ConvertOptions.model_validate({"to": "spz", "spz_version": "3"}).spz_version == 3
