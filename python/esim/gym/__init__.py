"""Environments of Gymnasium whose agents see events: `import esim.gym`. The rest of the package does not need Gymnasium.

An agent moves the camera's body; each step simulates the events meanwhile. `gymnasium.make("esim/Events-v0", ...)` makes an
`EventEnv`, and `gymnasium.make_vec("esim/Events-v0", num_envs=..., vectorization_mode="vector_entry_point", ...)` an
`EventVectorEnv`.
"""

import gymnasium

from ._event_env import EventEnv
from ._event_vector_env import EventVectorEnv
from ._motion import rotation

__all__ = ["EventEnv", "EventVectorEnv", "rotation"]

gymnasium.register("esim/Events-v0", entry_point=EventEnv, vector_entry_point=EventVectorEnv)
