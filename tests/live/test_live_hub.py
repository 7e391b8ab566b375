"""The hub: who is owed what, whatever is slow."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pondwatch.core.errors import Missing
from pondwatch.live.bus import LocalBus
from pondwatch.live.hub import Hub, StalledError, Timing
from pondwatch.live.protocol import Frame
from pondwatch.live.source import Patch
from tests.fakes.source import ScriptedSource
from tests.fakes.viewer import Viewer

QUICK = Timing(beat_s=0.05, recheck_s=60, stall_s=0.2)


@contextlib.asynccontextmanager
async def running(source: ScriptedSource, timing: Timing = QUICK) -> AsyncIterator[tuple[Hub, LocalBus]]:
    bus = LocalBus()
    hub = Hub(source, bus, timing)
    hub.start()
    try:
        yield hub, bus
    finally:
        await hub.stop()


@contextlib.asynccontextmanager
async def watching(hub: Hub, viewer: Viewer, since: int | None = None, cut_after: int = 10**9) -> AsyncIterator[None]:
    """A viewer on the hub; its link is cut within the frame after `cut_after` frames."""

    async def send(frame: Frame) -> None:
        if viewer.frames >= cut_after:
            raise ConnectionError("cut")
        viewer.take(frame)

    task = asyncio.create_task(hub.serve("s1", since, send))
    try:
        yield
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def until(viewer: Viewer, revision: int) -> None:
    async with asyncio.timeout(5):
        while viewer.revision != revision:
            await asyncio.sleep(0.002)


def news(source: ScriptedSource, bus: LocalBus, corner: int = 0) -> int:
    """A revision that changes one of everything."""
    content = f"pixels {source.revision}".encode()
    revision = source.step(
        patches=[Patch("mosaic", corner, 0, 8, 8, source.revision + 1, "image/png", content)],
        rods=[{"rod_id": f"R{corner}", "state": "full", "fill": 1.0, "confidence": 0.9, "views": source.revision}],
        poses=[{"robot": "a", "sequence": source.revision, "x_m": 0.1}],
        counts={"snapshots": source.revision},
    )
    bus.publish("s1", revision)
    return revision


async def whole_state(source: ScriptedSource) -> Viewer:
    """What a viewer that comes only now is shown."""
    late = Viewer()
    async with running(source) as (hub, _), watching(hub, late):
        await until(late, source.revision)
    return late


async def test_a_new_viewer_gets_hello_and_the_whole_state() -> None:
    source, viewer = ScriptedSource(), Viewer()
    async with running(source) as (hub, bus):
        news(source, bus)
        async with watching(hub, viewer):
            await until(viewer, 1)

    assert viewer.hellos[0]["full"] is True
    assert (viewer.pixels, list(viewer.rods)) == ({(0, 0): b"pixels 0"}, ["R0"])


async def test_news_reaches_a_viewer_without_its_asking() -> None:
    source, viewer = ScriptedSource(), Viewer()
    async with running(source) as (hub, bus), watching(hub, viewer):
        await until(viewer, 0)
        news(source, bus)
        await until(viewer, 1)

    assert viewer.pixels == {(0, 0): b"pixels 0"}


async def test_a_session_nobody_knows_is_missing() -> None:
    async with running(ScriptedSource()) as (hub, _):
        with pytest.raises(Missing):
            await hub.serve("other", None, lambda frame: asyncio.sleep(0))


SPELLS = st.lists(
    st.tuples(st.integers(1, 12), st.lists(st.tuples(st.integers(0, 5), st.booleans()), max_size=4)), max_size=5
)


@settings(max_examples=25, deadline=None)
@given(SPELLS)
async def test_a_viewer_cut_anywhere_ends_with_the_state_of_one_that_never_left(
    spells: list[tuple[int, list[tuple[int, bool]]]],
) -> None:
    source, faithful, cut = ScriptedSource(), Viewer(), Viewer()
    async with running(source) as (hub, bus), watching(hub, faithful):
        for frames, changes in spells:
            async with watching(hub, cut, since=cut.revision, cut_after=cut.frames + frames):
                for corner, pause in changes:
                    news(source, bus, corner)
                    await asyncio.sleep(0.001 if pause else 0)
        async with watching(hub, cut, since=cut.revision):
            await until(cut, source.revision)
            await until(faithful, source.revision)

    assert cut.state == faithful.state == (await whole_state(source)).state


async def test_a_viewer_of_a_past_that_is_gone_is_told_to_start_anew() -> None:
    source, viewer = ScriptedSource(oldest=5), Viewer()
    async with running(source) as (hub, bus):
        for _ in range(6):
            news(source, bus)
        viewer.rods["R_gone"] = {}
        async with watching(hub, viewer, since=2):
            await until(viewer, 6)

    assert viewer.hellos[0]["full"] is True
    assert "R_gone" not in viewer.rods


async def test_a_viewer_that_is_current_is_sent_nothing_again() -> None:
    source, viewer = ScriptedSource(), Viewer()
    async with running(source) as (hub, bus):
        news(source, bus)
        async with watching(hub, viewer, since=1):
            await until(viewer, 1)

    assert (viewer.hellos[0]["full"], viewer.pixels, viewer.rods) == (False, {}, {})


async def test_a_slow_viewer_takes_one_larger_step_and_never_a_queue() -> None:
    source, viewer, kinds = ScriptedSource(), Viewer(), list[str]()
    ready = asyncio.Event()

    async def slow(frame: Frame) -> None:
        kinds.append(viewer.take(frame))
        if viewer.revision == 1:
            await ready.wait()

    async with running(source, Timing(beat_s=9, recheck_s=60, stall_s=9)) as (hub, bus):
        news(source, bus)
        task = asyncio.create_task(hub.serve("s1", None, slow))
        await until(viewer, 1)
        for _ in range(50):
            news(source, bus)
        kinds.clear()
        ready.set()
        await until(viewer, 51)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    assert [kind for kind in kinds if kind != "beat"] == ["patch", "rods", "poses", "session"]
    assert viewer.pixels == {(0, 0): b"pixels 50"}


async def test_stalled_viewers_cost_the_others_nothing_and_are_let_go() -> None:
    source, viewer = ScriptedSource(), Viewer()

    async def stalled(frame: Frame) -> None:
        await asyncio.Event().wait()

    async with running(source) as (hub, bus), watching(hub, viewer):
        loop = asyncio.get_running_loop()
        stuck = [asyncio.create_task(hub.serve("s1", None, stalled)) for _ in range(3)]
        began = loop.time()
        for _ in range(5):
            await until(viewer, news(source, bus))
        assert loop.time() - began < QUICK.stall_s, "five revisions were not held up by one stall"
        results = await asyncio.gather(*stuck, return_exceptions=True)
        assert [type(result) for result in results] == [StalledError] * 3
        assert hub.viewers == 1


async def test_viewers_at_one_revision_share_one_reading() -> None:
    source, viewers = ScriptedSource(delay_s=0.02), [Viewer() for _ in range(20)]
    async with running(source) as (hub, bus), contextlib.AsyncExitStack() as stack:
        for viewer in viewers:
            await stack.enter_async_context(watching(hub, viewer))
        await asyncio.gather(*(until(viewer, 0) for viewer in viewers))
        source.reads.clear()
        news(source, bus)
        await asyncio.gather(*(until(viewer, 1) for viewer in viewers))

    assert source.reads == [(0, 1)]


async def test_a_link_with_no_news_still_beats() -> None:
    source, kinds = ScriptedSource(), list[str]()
    viewer = Viewer()

    async def send(frame: Frame) -> None:
        kinds.append(viewer.take(frame))

    async with running(source) as (hub, _):
        task = asyncio.create_task(hub.serve("s1", None, send))
        await asyncio.sleep(0.3)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    assert kinds[:2] == ["hello", "session"]
    assert set(kinds[2:]) == {"beat"}
    assert 3 <= len(kinds[2:]) <= 7, "about one in 0.05 s"


async def test_a_lost_message_is_made_good_by_the_next_look() -> None:
    source, viewer = ScriptedSource(), Viewer()
    async with running(source, Timing(beat_s=9, recheck_s=0.05, stall_s=9)) as (hub, _), watching(hub, viewer):
        await until(viewer, 0)
        source.step(rods=[{"rod_id": "R1"}])
        await until(viewer, 1)

    assert list(viewer.rods) == ["R1"]


async def test_a_job_that_moves_on_without_a_revision_is_told_once_a_change() -> None:
    source, told = ScriptedSource(), list[Frame]()

    async def send(frame: Frame) -> None:
        told.append(frame)

    async with running(source, Timing(beat_s=9, recheck_s=9, stall_s=9)) as (hub, bus):
        task = asyncio.create_task(hub.serve("s1", None, send))
        for progress in (0.25, 0.5, 0.5):
            await asyncio.sleep(0.03)
            source.jobs = [{"id": "j1", "progress": progress}]
            bus.publish("s1", 0)
        await asyncio.sleep(0.03)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    jobs = [frame for frame in told if isinstance(frame, str) and '"type":"job"' in frame]
    assert [("0.25" in job, "0.5" in job) for job in jobs] == [(True, False), (False, True)]


def alarm(number: int, text: str = "", retained: bool = True) -> dict[str, Any]:
    return {"id": number, "message": text, "retained": retained, "quiet": False}


async def rings(viewer: Viewer, *told: int) -> None:
    async with asyncio.timeout(5):
        while viewer.rung != list(told):
            await asyncio.sleep(0.002)


async def test_alarms_come_whole_at_first_and_then_each_that_is_otherwise_once() -> None:
    source, viewer = ScriptedSource(), Viewer()
    source.ring(alarm(1), alarm(2), alarm(3, retained=False))
    async with running(source) as (hub, bus), watching(hub, viewer):
        await rings(viewer, 1, 2)
        source.ring(alarm(1), alarm(2, "worse"), alarm(3, retained=False))
        news(source, bus)
        await rings(viewer, 1, 2, 2)
        source.ring(alarm(1, retained=False), alarm(2, "worse"), alarm(3, retained=False))
        bus.publish("s1", source.revision)  # alarms go on without a revision
        await rings(viewer, 1, 2, 2, 1)
        for corner in range(5):
            news(source, bus, corner)
        await until(viewer, source.revision)

    assert viewer.rung == [1, 2, 2, 1]


async def test_a_viewer_that_comes_back_is_told_all_alarms_anew() -> None:
    source, viewer = ScriptedSource(), Viewer()
    source.ring(alarm(1), alarm(2))
    async with running(source) as (hub, bus):
        news(source, bus)
        async with watching(hub, viewer):
            await rings(viewer, 1, 2)
            await until(viewer, 1)
        source.ring(alarm(1, retained=False), alarm(2))
        async with watching(hub, viewer, since=1):
            await rings(viewer, 1, 2, 2)

    assert list(viewer.alarms) == [2]
