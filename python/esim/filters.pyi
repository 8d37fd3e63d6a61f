# The interface of filters.py. Docstrings there give shapes and units.
from collections.abc import Mapping
from typing import Any

from . import Events, EventsLike, Int

class FilterChain:
    def __init__(
        self,
        width: Int,
        height: Int,
        *,
        region: Mapping[str, Any] | None = None,
        activity: Mapping[str, Any] | None = None,
        anti_flicker: Mapping[str, Any] | None = None,
        trail: Mapping[str, Any] | None = None,
        rate_controller: Mapping[str, Any] | None = None,
    ) -> None: ...
    def process(self, events: EventsLike) -> Events: ...
    @property
    def dropped(self) -> dict[str, int]: ...

def filter_events(
    events: EventsLike,
    width: Int | None = None,
    height: Int | None = None,
    *,
    region: Mapping[str, Any] | None = None,
    activity: Mapping[str, Any] | None = None,
    anti_flicker: Mapping[str, Any] | None = None,
    trail: Mapping[str, Any] | None = None,
    rate_controller: Mapping[str, Any] | None = None,
) -> Events: ...
