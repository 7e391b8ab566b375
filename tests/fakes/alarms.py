"""Alarms of every kind and in every state, as a server tells them."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from pondwatch.core.alarms import Alarm, AlarmKey, Comment, Kind
from pondwatch.jobs import alarmviews


def every_state(flood: int = 12) -> list[dict[str, Any]]:
    """One of each kind, `flood` rods that changed, and some that were answered or set aside."""
    now_s = time.time()

    def ringing(kind: Kind, subject: str, text: str, ago_s: float) -> Alarm:
        key = AlarmKey(kind, subject)
        return Alarm(key, text, active=True, acknowledged=False, since_s=now_s - ago_s, occurrences=1)

    rods = [
        ringing(Kind.ROD_CHANGED, f"R{i:04d}", f"Rod R{i:04d} was full in the baseline, and reads empty.", 200 + i)
        for i in range(flood)
    ]
    silent = ringing(Kind.ROBOT_SILENT, "bubble-3", "Robot bubble-3 was last heard at 09:12:44 UTC.", 12)
    stale = ringing(Kind.COVERAGE_STALE, "", "About 40 % was seen twice in the last 30 minutes.", 300)
    said = Comment(now_s - 60, "Ada", "acknowledge", "The diver is at work there; robots pass again at ten.")
    poor = ringing(Kind.CORRECTION_POOR, "", "About 15 % of the snapshots are not surely placed.", 4000)
    low = ringing(Kind.DISK_LOW, "", "About 1.1 GB are free in the data folder.", 90)
    conflicting = ringing(Kind.ROD_CONFLICTING, "R0137", "Looks at rod R0137 disagree.", 30)
    alarms = [
        *rods,
        silent,
        stale,
        low,
        replace(poor, acknowledged=True, comments=(said,)),
        replace(conflicting, active=False),
        replace(silent, key=AlarmKey(Kind.ROBOT_SILENT, "bubble-4"), shelved_until_s=now_s + 1800),
        replace(silent, key=AlarmKey(Kind.ROBOT_SILENT, "bubble-5"), out_of_service=True),
        replace(silent, key=AlarmKey(Kind.ROBOT_SILENT, "bubble-6"), suppressed=True, acknowledged=True),
    ]
    return [alarmviews.alarm(number, alarm) for number, alarm in enumerate(alarms, 1)]
