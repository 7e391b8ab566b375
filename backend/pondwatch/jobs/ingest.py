"""Taking a snapshot in: checked, stored and committed before anyone is told that it is safe."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass

from sqlalchemy import Connection

from pondwatch.core.errors import DigestMismatch, SessionFinished
from pondwatch.core.images import MEDIA_TYPES, check_header, decode, digest_of
from pondwatch.core.ports import Clock
from pondwatch.core.values import NO_REPORT, RobotReport, SnapshotKey
from pondwatch.store import jobs, sessions, snapshots
from pondwatch.store.sessions import Session, State
from pondwatch.store.snapshots import NewSnapshot, StoredSnapshot
from pondwatch.store.store import Store


@dataclass(frozen=True, slots=True)
class Upload:
    """A snapshot as it arrived. digest: `sha256:<hex>` made where the image was, None where the sender made none."""

    key: SnapshotKey
    captured_ms: int
    x_m: float
    y_m: float
    theta_rad: float
    image: bytes
    digest: str | None = None
    report: RobotReport = NO_REPORT


@dataclass(frozen=True, slots=True)
class Receipt:
    """What is said of a stored snapshot. is_new: it was not there before."""

    session_id: str
    stored: StoredSnapshot
    is_new: bool


class Ingest:
    """Takes snapshots in. `wake` hears of every session that got one."""

    def __init__(self, store: Store, clock: Clock, wake: Callable[[str], None]) -> None:
        self._store, self._clock, self._wake = store, clock, wake

    def session(self, session_id: str) -> Session:
        """The session that snapshots are for.

        Raises:
            Missing: there is none by this id.
        """
        return self._store.read(lambda c: sessions.get(c, session_id))

    def accept(self, session: Session, upload: Upload) -> Receipt:
        """Store a snapshot; returns once it is on disk. The same one again is answered as the first time.

        Raises:
            InvalidImage, DigestMismatch, SnapshotConflict, SessionFinished, StorageFull, Unavailable: nothing of it
            was stored.
        """
        before = self._store.read(lambda c: snapshots.find(c, session.id, upload.key))
        return self._accept(session, before, upload)

    def take(self, session_id: str, upload: Upload) -> Receipt:
        """`accept`, for the session by its id.

        Raises:
            Missing: there is none. Else as `accept`.
        """

        def look(connection: Connection) -> tuple[Session, StoredSnapshot | None]:
            return sessions.get(connection, session_id), snapshots.find(connection, session_id, upload.key)

        return self._accept(*self._store.read(look), upload)

    def _accept(self, session: Session, before: StoredSnapshot | None, upload: Upload) -> Receipt:
        new = self._checked(session, upload)
        if before is not None:
            return Receipt(session.id, snapshots.matched(before, new), is_new=False)
        _check_open(session.id, session.state)
        decode(upload.image, session.inspection.camera)
        self._store.blobs.put(upload.image)
        receipt = self._commit(session.id, new).result()
        self._wake(session.id)
        return receipt

    @staticmethod
    def _checked(session: Session, upload: Upload) -> NewSnapshot:
        found = digest_of(upload.image)
        if upload.digest is not None and upload.digest != found:
            raise DigestMismatch(
                "The picture is not the one that its digest was made of; it was damaged on the way.",
                expected=upload.digest,
                found=found,
            )
        header = check_header(upload.image, session.inspection.camera)
        return NewSnapshot(
            upload.key,
            upload.captured_ms,
            upload.x_m,
            upload.y_m,
            upload.theta_rad,
            found.removeprefix("sha256:"),
            len(upload.image),
            MEDIA_TYPES[header.kind],
            upload.report,
        )

    def _commit(self, session_id: str, new: NewSnapshot) -> Future[Receipt]:
        now_ms = int(self._clock.now_s() * 1000)

        def unit(connection: Connection) -> Receipt:
            before = snapshots.find(connection, session_id, new.key)
            if before is not None:
                return Receipt(session_id, snapshots.matched(before, new), is_new=False)
            _check_open(session_id, sessions.state_of(connection, session_id))
            stored = snapshots.add(connection, session_id, new, now_ms)
            jobs.queue(connection, session_id, "advance", now_ms)
            return Receipt(session_id, stored, is_new=True)

        return self._store.writer.submit(unit)


def _check_open(session_id: str, state: State) -> None:
    if state is not State.OPEN:
        raise SessionFinished(f"The session is {state.value}; it takes no more snapshots.", session=session_id)
