"""An environment of Gymnasium whose agent sees events: `import esim.gym`. The rest of the package does not need Gymnasium.

The agent moves the camera's body; each step simulates the events meanwhile. `gymnasium.make("esim/Events-v0", ...)` makes an
`EventEnv` too.
"""

import gymnasium

from ._event_env import EventEnv, rotation

__all__ = ["EventEnv", "rotation"]

gymnasium.register("esim/Events-v0", entry_point=EventEnv)
