"""What requests must say. Pydantic stands at this border only."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AwareDatetime,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    StringConstraints,
    TypeAdapter,
    model_validator,
)
from pydantic import ValidationError as Fault

from pondwatch.core.alarmacts import Act
from pondwatch.core.errors import InvalidPose, PondwatchError
from pondwatch.core.values import RobotReport, SnapshotKey
from pondwatch.jobs.alarms import Deed
from pondwatch.jobs.ingest import Upload
from pondwatch.store.judgements import NewJudgement
from pondwatch.store.notes import NewNote

from .problems import InvalidRequest, invalid_request

MOST = 2**53 - 1  # what JavaScript still counts exactly
Name = Annotated[str, StringConstraints(min_length=1, max_length=64, pattern=r"^[^\x00-\x1f\x7f/]+$")]
Count = Annotated[int, Field(strict=True, ge=0, le=MOST)]
Digest = Annotated[str, StringConstraints(pattern=r"^sha256:[0-9a-f]{64}$")]
Metres = Annotated[FiniteFloat, Field(strict=True, ge=-1e6, le=1e6)]
Moment = Annotated[
    AwareDatetime, Field(strict=True, ge=datetime(1970, 1, 1, tzinfo=UTC), lt=datetime(2200, 1, 1, tzinfo=UTC))
]
_POSE_FIELDS = {"x_m", "y_m", "theta_rad"}


def _share_or_nothing(value: object) -> float | None:
    """No snapshot is refused for what its robot says of itself."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if 0 <= value <= 1 else None


Said = Annotated[float | None, BeforeValidator(_share_or_nothing)]


class PoseIn(BaseModel):
    """Part `pose` of an upload: the snapshot's key, when it was taken, and its noisy pose in the pond frame. What the
    robot says of itself is from 0 to 1; anything else is passed over."""

    model_config = ConfigDict(extra="ignore")

    robot: Name
    sequence: Count
    boot: Count = 0
    captured_at: Moment
    x_m: Metres
    y_m: Metres
    theta_rad: Metres
    digest: Digest | None = None
    battery: Said = None
    link_loss: Said = None
    image_quality: Said = None

    def upload(self, image: bytes) -> Upload:
        """With its picture, as the jobs take it."""
        key = SnapshotKey(self.robot, self.boot, self.sequence)
        said = RobotReport(self.battery, self.link_loss, self.image_quality)
        return Upload(key, _ms(self.captured_at), self.x_m, self.y_m, self.theta_rad, image, self.digest, said)


class BatchItemIn(PoseIn):
    """An item of part `poses`. image: the name of the part that holds its picture."""

    image: Annotated[str, StringConstraints(min_length=1, max_length=200)]


class CorrectionIn(BaseModel):
    """What a session is to be corrected again by."""

    model_config = ConfigDict(extra="ignore")

    method: Name


Words = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=2000)]
_SURE = {"empty": 0.0, "full": 1.0}


class JudgementIn(BaseModel):
    """What a person says of a rod. state: None takes earlier words back. fill: only of a partly filled rod."""

    model_config = ConfigDict(extra="ignore")

    state: Literal["empty", "partial", "full"] | None
    fill: Annotated[FiniteFloat, Field(ge=0.05, le=0.95)] | None = None
    reason: Words
    by: Name

    @model_validator(mode="after")
    def _agree(self) -> Self:
        if (self.fill is not None) != (self.state == "partial"):
            raise ValueError("fill, from 0.05 to 0.95, is told of a partly filled rod and of no other")
        return self

    def judgement(self, rod_id: str) -> NewJudgement:
        """As it is stored."""
        fill = self.fill if self.state is None else _SURE.get(self.state, self.fill)
        return NewJudgement(rod_id, self.state, fill, self.reason, self.by)


class NoteIn(BaseModel):
    """A note of a rod, a place (both of x_m, y_m; pond frame), a moment, or the whole inspection."""

    model_config = ConfigDict(extra="ignore")

    text: Words
    by: Name
    rod_id: Annotated[str, StringConstraints(min_length=1, max_length=200)] | None = None
    x_m: Metres | None = None
    y_m: Metres | None = None
    moment: (
        Annotated[AwareDatetime, Field(ge=datetime(1970, 1, 1, tzinfo=UTC), lt=datetime(2200, 1, 1, tzinfo=UTC))] | None
    ) = None

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if (self.x_m is None) != (self.y_m is None):
            raise ValueError("a place has both x_m and y_m")
        return self

    def note(self) -> NewNote:
        """As it is stored."""
        moment = None if self.moment is None else _ms(self.moment)
        return NewNote(self.text, self.by, self.rod_id, self.x_m, self.y_m, moment)


class CloseIn(BaseModel):
    """Who has dealt with a note."""

    model_config = ConfigDict(extra="ignore")

    by: Name


class DeedIn(BaseModel):
    """Why something is done to an alarm, and by whom. for_s: how long it is shelved; absent: until it is over."""

    model_config = ConfigDict(extra="ignore")

    comment: Words
    by: Name
    for_s: Annotated[FiniteFloat, Field(strict=True, gt=0)] | None = None

    def deed(self, act: Act) -> Deed:
        """As the jobs take it."""
        return Deed(act, self.by, self.comment, self.for_s)


class GroupDeedIn(DeedIn):
    """The same for many alarms."""

    alarms: Annotated[list[Count], Field(min_length=1, max_length=50_000)]


class BaselineIn(BaseModel):
    """Which earlier session this one is held against; null for none."""

    model_config = ConfigDict(extra="ignore")

    baseline: Annotated[str, StringConstraints(min_length=1, max_length=40)] | None


class NameIn(BaseModel):
    """A pond's name."""

    name: Name


_ITEMS = TypeAdapter(list[Any])


def pose_of(text: bytes | str) -> PoseIn:
    """The part `pose`.

    Raises:
        InvalidPose: x_m, y_m or theta_rad is not a finite number. InvalidRequest: anything else is not as it should be.
    """
    try:
        return PoseIn.model_validate_json(text)
    except Fault as fault:
        raise _refusal(fault) from None


def items_of(text: bytes | str, most: int) -> list[BatchItemIn | PondwatchError]:
    """The part `poses`: every item, or what is wrong with it.

    Raises:
        InvalidRequest: it is not a JSON array, or of more than `most` items.
    """
    try:
        listed = _ITEMS.validate_json(text)
    except Fault as fault:
        raise _refusal(fault) from None
    if len(listed) > most:
        raise InvalidRequest(f"poses: there are {len(listed)} items; {most} are the most.", field="poses")
    return [_item(value) for value in listed]


def _item(value: object) -> BatchItemIn | PondwatchError:
    try:
        return BatchItemIn.model_validate_json(json.dumps(value))
    except Fault as fault:
        return _refusal(fault)


def _refusal(fault: Fault) -> PondwatchError:
    first = fault.errors(include_url=False, include_input=False, include_context=False)[0]
    found = invalid_request([first])
    if first["loc"] and first["loc"][0] in _POSE_FIELDS and first["type"] != "missing":
        return InvalidPose(found.message, **found.facts)
    return found


def _ms(moment: datetime) -> int:
    return round(moment.timestamp() * 1000)
