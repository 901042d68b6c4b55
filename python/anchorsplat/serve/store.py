"""Persistent state: jobs in SQLite, uploads and results in folders beside it.

    DIR/lock          held by the one service that works here
    DIR/jobs.sqlite3
    DIR/uploads/      what is on its way in
    DIR/inputs/ID     by the SHA-256 of their content
    DIR/work/KEY/     of jobs that run
    DIR/results/KEY/  whole ones only; KEY is the hash of input, options and program

A *work* is something to compute, known by its key; a *job* is one client's wish for it, known by an id that cannot be
guessed. The same wish twice is two jobs of one work. Called from the thread of the event loop only, folders excepted.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import secrets
import shutil
import sqlite3
import time
from collections.abc import Callable
from pathlib import Path

_SCHEMA_VERSION = 1
_SCHEMA = """
CREATE TABLE inputs (id TEXT PRIMARY KEY, bytes INTEGER NOT NULL, facts TEXT NOT NULL, used REAL NOT NULL);
CREATE TABLE works (
  key TEXT PRIMARY KEY, kind TEXT NOT NULL, options TEXT NOT NULL, input TEXT NOT NULL, cameras TEXT,
  state TEXT NOT NULL, attempts INTEGER NOT NULL DEFAULT 0, created REAL NOT NULL, started REAL, finished REAL,
  used REAL NOT NULL, bytes INTEGER NOT NULL DEFAULT 0, report TEXT, error_code TEXT, error TEXT);
CREATE INDEX works_of_state ON works (state, created);
CREATE INDEX works_of_input ON works (input);
CREATE TABLE jobs (id TEXT PRIMARY KEY, key TEXT NOT NULL, name TEXT NOT NULL, created REAL NOT NULL, cancelled INTEGER NOT NULL DEFAULT 0);
CREATE INDEX jobs_of_work ON jobs (key);
"""

_MOST_STARTS = 3  # of a work, if the service is killed while it runs
QUEUED, RUNNING, DONE, FAILED, CANCELLED = "queued", "running", "done", "failed", "cancelled"
ENDED = (DONE, FAILED, CANCELLED)


class DataInUse(Exception):
    """Another service uses the folder."""


class Store:
    def __init__(self, folder: Path, now: Callable[[], float] = time.time):
        self.folder = folder
        self._now = now
        for name in ("uploads", "inputs", "work", "results"):
            (folder / name).mkdir(mode=0o700, parents=True, exist_ok=True)
        self._lock = open(folder / "lock", "w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._lock.close()
            raise DataInUse(
                f"{folder}: another 'anchorsplat serve' uses this folder; stop it, or pass another --data"
            ) from None
        try:
            self._open()
        except sqlite3.DatabaseError as error:
            self.close()
            raise DataInUse(
                f"{folder / 'jobs.sqlite3'}: cannot be read ({error}); pass another --data, or move this file away "
                "to start without jobs"
            ) from None

    def _open(self) -> None:
        folder = self.folder
        self._db = sqlite3.connect(folder / "jobs.sqlite3", isolation_level=None)
        self._db.row_factory = sqlite3.Row
        self._db.execute("PRAGMA journal_mode=WAL")
        self._db.execute("PRAGMA synchronous=NORMAL")
        version = self._db.execute("PRAGMA user_version").fetchone()[0]
        if version == 0:
            self._db.executescript(f"BEGIN; {_SCHEMA} PRAGMA user_version={_SCHEMA_VERSION}; COMMIT;")
        elif version != _SCHEMA_VERSION:
            self.close()
            raise DataInUse(
                f"{folder}: made by another version of anchorsplat (schema {version}); pass another --data"
            )
        self._begin()

    def close(self) -> None:
        self._db.close()
        self._lock.close()

    def _begin(self) -> None:
        """Queues works again that ran when the last service ended, and removes unfinished files."""
        self._db.execute(
            "UPDATE works SET state=?, finished=?, error_code='killed', error=? WHERE state=? AND attempts>=?",
            (
                FAILED,
                self._now(),
                "The service ended every time while this ran, so it is not tried again.",
                RUNNING,
                _MOST_STARTS,
            ),
        )
        self._db.execute("UPDATE works SET state=?, started=NULL WHERE state=?", (QUEUED, RUNNING))
        for path in (self.folder / "uploads").iterdir():  # and the folders in which they were checked
            _remove(path)
        queued = {row[0] for row in self._db.execute("SELECT key FROM works WHERE state=?", (QUEUED,))}
        for path in (self.folder / "work").iterdir():
            if path.name not in queued:  # a queued work may resume from the state in its folder
                _remove(path)
        known = {row[0] for row in self._db.execute("SELECT key FROM works WHERE state=?", (DONE,))}
        for path in (self.folder / "results").iterdir():
            if path.name not in known:
                _remove(path)
        for key in known:  # a folder was deleted by hand
            if not self.result_folder(key).is_dir():
                self._db.execute("DELETE FROM works WHERE key=?", (key,))
        inputs = {row[0] for row in self._db.execute("SELECT id FROM inputs")}
        for path in (self.folder / "inputs").iterdir():
            if path.name not in inputs:
                _remove(path)

    # Inputs

    def input_path(self, input_id: str) -> Path:
        return self.folder / "inputs" / input_id

    def new_upload(self) -> Path:
        return self.folder / "uploads" / secrets.token_hex(16)

    def add_input(self, upload: Path, input_id: str, facts: dict) -> None:
        """Stores a finished upload under the hash of its content, so it replaces only an equal file."""
        size = upload.stat().st_size
        os.replace(upload, self.input_path(input_id))
        self._db.execute(
            "INSERT INTO inputs VALUES (?,?,?,?) ON CONFLICT (id) DO UPDATE SET used=excluded.used",
            (input_id, size, json.dumps(facts), self._now()),
        )

    def input_facts(self, input_id: str) -> dict | None:
        row = self._db.execute("SELECT facts FROM inputs WHERE id=?", (input_id,)).fetchone()
        if row is None or not self.input_path(input_id).exists():
            return None
        self._db.execute("UPDATE inputs SET used=? WHERE id=?", (self._now(), input_id))
        return json.loads(row[0])

    # Works

    def work_folder(self, key: str) -> Path:
        return self.folder / "work" / key

    def result_folder(self, key: str) -> Path:
        return self.folder / "results" / key

    def work(self, key: str) -> sqlite3.Row | None:
        return self._db.execute("SELECT * FROM works WHERE key=?", (key,)).fetchone()

    def next_work(self) -> sqlite3.Row | None:
        """Takes the work that has waited longest and marks it as running."""
        row = self._db.execute(
            "UPDATE works SET state=?, started=?, attempts=attempts+1 WHERE key="
            "(SELECT key FROM works WHERE state=? ORDER BY created, rowid LIMIT 1) RETURNING *",
            (RUNNING, self._now(), QUEUED),
        ).fetchall()
        return row[0] if row else None

    def requeue(self, key: str, *, again: bool = False) -> None:
        """Queues an interrupted work again. The attempt does not count, unless it is retried (`again`) after a failure."""
        self._db.execute(
            "UPDATE works SET state=?, started=NULL, attempts=attempts-? WHERE key=? AND state=?",
            (QUEUED, 0 if again else 1, key, RUNNING),
        )

    def finish(self, key: str, report: dict) -> None:
        """Moves the result from the work's folder to its place, as a whole."""
        work, result = self.work_folder(key), self.result_folder(key)
        if result.exists():
            shutil.rmtree(result)
        os.replace(work, result)
        now = self._now()
        self._db.execute(
            "UPDATE works SET state=?, finished=?, used=?, bytes=?, report=?, error=NULL, error_code=NULL WHERE key=?",
            (DONE, now, now, _size(result), json.dumps(report), key),
        )

    def fail(self, key: str, state: str, code: str, message: str) -> None:
        shutil.rmtree(self.work_folder(key), ignore_errors=True)
        now = self._now()
        self._db.execute(
            "UPDATE works SET state=?, finished=?, used=?, error_code=?, error=? WHERE key=?",
            (state, now, now, code, message, key),
        )

    def measure(self, key: str) -> None:
        """Updates the size after a file was added to a result."""
        self._db.execute("UPDATE works SET bytes=? WHERE key=?", (_size(self.result_folder(key)), key))

    def touch(self, key: str) -> None:
        self._db.execute("UPDATE works SET used=? WHERE key=?", (self._now(), key))

    def count(self, state: str) -> int:
        return self._db.execute("SELECT count(*) FROM works WHERE state=?", (state,)).fetchone()[0]

    def position(self, work: sqlite3.Row) -> int:
        """Number of works in the queue up to this one."""
        return self._db.execute(
            "SELECT count(*) FROM works WHERE state=? AND (created, key) <= (?, ?)",
            (QUEUED, work["created"], work["key"]),
        ).fetchone()[0]

    # Jobs

    def add_job(self, kind: str, options: str, input_id: str, cameras: str | None, fingerprint: str, name: str) -> str:
        """Adds a job, and a work for it unless one is waiting, running or done. Returns the job's id."""
        text = "\n".join((fingerprint, kind, options, input_id, cameras or ""))
        key = hashlib.sha256(text.encode()).hexdigest()
        now = self._now()
        job = secrets.token_urlsafe(18)
        with self._transaction():
            self._db.execute(
                "INSERT INTO works (key, kind, options, input, cameras, state, created, used) VALUES (?,?,?,?,?,?,?,?) "
                "ON CONFLICT (key) DO UPDATE SET used=excluded.used",
                (key, kind, options, input_id, cameras, QUEUED, now, now),
            )
            # A failed work may succeed now, with more memory or disk space.
            self._db.execute(
                "UPDATE works SET state=?, created=?, attempts=0, started=NULL, finished=NULL, error=NULL, error_code=NULL "
                "WHERE key=? AND state IN (?,?)",
                (QUEUED, now, key, FAILED, CANCELLED),
            )
            self._db.execute("INSERT INTO jobs (id, key, name, created) VALUES (?,?,?,?)", (job, key, name, now))
        return job

    def job(self, job_id: str) -> sqlite3.Row | None:
        return self._db.execute("SELECT * FROM jobs WHERE id=?", (job_id,)).fetchone()

    def cancel_job(self, job_id: str, key: str) -> bool:
        """Cancels the job. True if no other job waits for its work, which can then be stopped."""
        self._db.execute("UPDATE jobs SET cancelled=1 WHERE id=?", (job_id,))
        return not self.is_wanted(key)

    def is_wanted(self, key: str) -> bool:
        return (
            self._db.execute("SELECT 1 FROM jobs WHERE key=? AND NOT cancelled LIMIT 1", (key,)).fetchone() is not None
        )

    def forget_job(self, job_id: str, key: str) -> None:
        """Deletes the job, and its result if no other job has it."""
        self._db.execute("DELETE FROM jobs WHERE id=?", (job_id,))
        work = self.work(key)
        if (
            work
            and work["state"] in ENDED
            and not self._db.execute("SELECT 1 FROM jobs WHERE key=? LIMIT 1", (key,)).fetchone()
        ):
            self._forget_work(key)
        self._forget_inputs(older_than=self._now() - 60)

    # Cleaning up

    def sweep(self, keep_days: float, keep_bytes: int, busy: Callable[[str], bool] = lambda key: False) -> int:
        """Deletes what was unused for so many days, then the longest unused until the rest fits. Returns the number of works."""
        before = self._now() - keep_days * 86400
        gone = 0
        rows = self._db.execute(f"SELECT key, used FROM works WHERE state IN {ENDED} ORDER BY used").fetchall()
        for row in rows:
            if busy(row["key"]):
                continue
            if row["used"] >= before and self.stored_bytes() <= keep_bytes:
                break
            self._forget_work(row["key"])
            self._forget_inputs(older_than=self._now() - 60)
            gone += 1
        self._forget_inputs(older_than=self._now() - 60)
        return gone

    def stored_bytes(self) -> int:
        inputs = self._db.execute("SELECT coalesce(sum(bytes), 0) FROM inputs").fetchone()[0]
        return inputs + self._db.execute("SELECT coalesce(sum(bytes), 0) FROM works").fetchone()[0]

    def _forget_work(self, key: str) -> None:
        with self._transaction():
            self._db.execute("DELETE FROM jobs WHERE key=?", (key,))
            self._db.execute("DELETE FROM works WHERE key=?", (key,))
        shutil.rmtree(self.result_folder(key), ignore_errors=True)

    def _forget_inputs(self, older_than: float) -> None:
        """Deletes uploads without a work that were last used before `older_than`."""
        unused = "SELECT id FROM inputs WHERE used < ? AND id NOT IN (SELECT input FROM works) AND id NOT IN (SELECT cameras FROM works WHERE cameras IS NOT NULL)"
        for (input_id,) in self._db.execute(unused, (older_than,)).fetchall():
            self._db.execute("DELETE FROM inputs WHERE id=?", (input_id,))
            self.input_path(input_id).unlink(missing_ok=True)

    def _transaction(self):
        return _Transaction(self._db)


class _Transaction:
    def __init__(self, db: sqlite3.Connection):
        self._db = db

    def __enter__(self) -> None:
        self._db.execute("BEGIN IMMEDIATE")

    def __exit__(self, kind, *_) -> None:
        self._db.execute("COMMIT" if kind is None else "ROLLBACK")


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink()


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
