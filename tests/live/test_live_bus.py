"""The in-process bus."""

import asyncio
import threading

from pondwatch.live.bus import LocalBus


async def test_threads_publish_and_the_loop_hears_the_newest_of_each_session() -> None:
    bus, heard = LocalBus(), dict[str, int]()
    bus.subscribe(lambda session, revision: heard.__setitem__(session, revision))
    bus.attach(asyncio.get_running_loop())

    def publish(session: str) -> None:
        for revision in range(100):
            bus.publish(session, revision)

    threads = [threading.Thread(target=publish, args=(name,)) for name in ("a", "b")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    await asyncio.sleep(0.01)

    assert heard == {"a": 99, "b": 99}


async def test_a_busy_loop_is_told_once_and_of_the_newest() -> None:
    bus, heard = LocalBus(), list[tuple[str, int]]()
    bus.subscribe(lambda session, revision: heard.append((session, revision)))
    bus.attach(asyncio.get_running_loop())

    for revision in range(10_000):
        bus.publish("a", revision)
    await asyncio.sleep(0)

    assert heard == [("a", 9999)]


async def test_what_was_published_before_anyone_listened_is_heard_at_the_start() -> None:
    bus, heard = LocalBus(), list[tuple[str, int]]()
    bus.publish("a", 3)
    bus.subscribe(lambda session, revision: heard.append((session, revision)))

    bus.attach(asyncio.get_running_loop())
    await asyncio.sleep(0)

    assert heard == [("a", 3)]


async def test_who_unsubscribed_hears_nothing() -> None:
    bus, heard = LocalBus(), list[int]()
    end = bus.subscribe(lambda _, revision: heard.append(revision))
    bus.attach(asyncio.get_running_loop())

    end()
    bus.publish("a", 1)
    await asyncio.sleep(0.01)

    assert heard == []


def test_publishing_to_a_loop_that_is_closed_harms_nobody() -> None:
    bus, loop = LocalBus(), asyncio.new_event_loop()
    bus.attach(loop)
    loop.close()

    bus.publish("a", 1)
