#!/usr/bin/env python3
"""An agent learns from its reward to fly through a hall with columns, steering by the events of its camera.

    avoidance.py --out out/avoidance                 (trains for a few minutes on one core, then evaluates)
    avoidance.py --out out/avoidance --evaluate      (evaluates the trained policy again)

The agent flies forwards at 2 m/s and chooses its yaw rate ten times per second. It sees the events of the last three steps,
counted in blocks of pixels, and knows its yaw rates and its heading in the hall, as from a gyroscope. Its reward is the progress
along the hall; an episode ends with a collision, or after 30 s. The policy is a small network, trained with PPO
(Schulman et al., 2017) on many agents at once. It is evaluated in other halls, which make_hall.py makes with other seeds.

Writes into the folder: the halls, policy.pt, log.csv and result.json. Needs gymnasium, torch and Pillow.
"""

import argparse
import csv
import json
import pathlib
import sys
import time

import numpy as np
import torch
from torch import nn

import esim.gym
from make_hall import make_hall

SPEED, YAW_RATE = 2.0, 2.0  # m/s; the maximum, rad/s
STEP_S, EPISODE_S = 0.1, 30.0
BODY_M, EYE_M = 0.25, 1.5  # radius of the body; height of the camera above the floor
HISTORY = 3  # steps that the agent sees
WIDTH, HEIGHT = 64, 16  # of the camera, px
BLOCK = 4, 2  # rows and columns of pixels that are counted together
ROWS, SECTORS = HEIGHT // BLOCK[0], WIDTH // BLOCK[1]

AGENTS, STEPS = 32, 64  # of a batch: 32 agents for 64 steps
DISCOUNT, GAE_LAMBDA, CLIP = 0.97, 0.95, 0.2
EPOCHS, MINIBATCH, RATE = 4, 256, 1e-3

TRAINING_HALL, OTHER_HALLS, STARTS = 1, (101, 102, 103, 104), 32  # seeds; evaluated starts per hall


class Hall:
    """A hall, its scenario, and collisions in closed form."""

    def __init__(self, folder, seed):
        self.folder = pathlib.Path(folder) / f"hall_{seed}"
        make_hall(self.folder, seed)
        contents = json.loads((self.folder / "hall.json").read_text())
        self.length, self.width = contents["length_m"], contents["width_m"]
        self.columns = np.array(contents["columns_x_y_radius_m"])

    def clearance(self, xy):
        """Distance from points (N, 2) to the nearest column or wall (N,), m; negative inside of them."""
        x, y = xy.T
        to_columns = np.linalg.norm(xy[:, None] - self.columns[:, :2], axis=-1) - self.columns[:, 2]
        to_walls = np.min([x, self.length - x, self.width / 2 - np.abs(y)], axis=0)
        return np.minimum(to_columns.min(axis=1), to_walls)

    def start(self, random):
        """A pose roughly along the hall, with 1.2 m of free space, so far from its end that no agent reaches it."""
        xy = np.zeros((1, 2))
        while self.clearance(xy) < 1.2:
            xy[0] = random.uniform([0, -self.width / 2], [self.length - 1.1 * SPEED * EPISODE_S, self.width / 2])
        angle = random.uniform(-0.5, 0.5)
        c, s = np.cos(angle), np.sin(angle)
        T = np.eye(4)  # of the camera: x to the right, y down, z forwards
        T[:3, :3] = [[s, 0, c], [-c, 0, s], [0, -1, 0]]
        T[:3, 3] = [*xy[0], EYE_M]
        return T

    def environment(self, agents, threads):
        scenario = {
            "duration_s": EPISODE_S,
            "renderer": {"type": "mesh", "scene": str(self.folder / "hall.obj"), "samples_per_pixel": 1},
            "camera": {"width": WIDTH, "height": HEIGHT, "horizontal_fov_deg": 100},
            "event_camera": {"contrast_threshold": 0.2},
            # At most two pixels between samples. All steps end at a sample, so that none waits for its last events.
            "sampling": {"type": "uniform", "rate_hz": 100},
        }

        def collided(env, infos):
            return self.clearance(infos["pose"][:, :2, 3]) < BODY_M

        def progress(env, infos):
            return np.where(collided(env, infos), 0, STEP_S * infos["velocity"][:, 0])

        return esim.gym.EventVectorEnv(
            agents, scenario, self.start, reward=progress, terminated=collided, threads=threads, autoreset="same_step",
            observation="counts", step_s=STEP_S, interval_s=0.02, max_velocity=SPEED, max_angular_velocity=YAW_RATE,
        )  # fmt: skip


def twists(steer):
    """Actions (N, 6) of agents that fly forwards and steer (N,): from -1, left, to 1, right."""
    actions = np.zeros((len(steer), 6))
    actions[:, 2], actions[:, 4] = 1, steer
    return actions


def pooled(counts):
    """Counts of events (N, 2, HEIGHT, WIDTH) in blocks (N, 2, ROWS, SECTORS). A surface makes events in proportion to its motion in
    the image: at a given speed, the number per metre of flight grows with its nearness. Its logarithm is the input."""
    blocks = counts.reshape(len(counts), 2, ROWS, BLOCK[0], SECTORS, BLOCK[1]).mean(axis=(3, 5))
    return np.log1p(0.1 * blocks / (SPEED * STEP_S))


class Memory:
    """What agents have seen in the last steps: images (N, HISTORY, 2, ROWS, SECTORS), and numbers (N, HISTORY + 1): their yaw
    rates, from -1 to 1, and the heading, rad. Both change sign if left and right are exchanged."""

    def __init__(self, agents):
        self.images = np.zeros((agents, HISTORY, 2, ROWS, SECTORS), np.float32)
        self.numbers = np.zeros((agents, HISTORY + 1), np.float32)

    def see(self, counts, steer, pose):
        self.images = np.concatenate([self.images[:, 1:], pooled(counts)[:, None]], axis=1)
        heading = -np.arctan2(pose[:, 1, 2], pose[:, 0, 2])  # to the right, as the yaw rate
        self.numbers = np.column_stack([self.numbers[:, 1:HISTORY], np.clip(steer, -1, 1), heading]).astype(np.float32)

    def forget(self, which, pose):
        """Episodes of the agents `which` (N,) begin at poses."""
        self.images[which], self.numbers[which] = 0, 0
        self.numbers[which, -1] = -np.arctan2(pose[which, 1, 2], pose[which, 0, 2])

    def tensors(self):
        return torch.from_numpy(self.images.copy()), torch.from_numpy(self.numbers.copy())


class Policy(nn.Module):
    """The mean of the steering (N,), and the expected return (N,). It knows that left and right are equivalent: a mirrored
    view steers to the other side, and has the same value."""

    def __init__(self):
        super().__init__()
        self.eye = nn.Sequential(  # convolutions along the azimuth; rows are channels
            nn.Conv1d(HISTORY * 2 * ROWS, 32, 5, stride=2, padding=2), nn.ReLU(),
            nn.Conv1d(32, 32, 3, stride=2, padding=1), nn.ReLU(), nn.Flatten(),
        )  # fmt: skip
        self.head = nn.Sequential(nn.Linear(32 * (SECTORS // 4) + HISTORY + 1, 64), nn.ReLU(), nn.Linear(64, 2))
        self.log_deviation = nn.Parameter(torch.tensor(-0.7))
        with torch.no_grad():
            self.head[-1].weight *= 0.1  # begins close to straight ahead

    def forward(self, images, numbers):
        images = torch.cat([images, images.flip(-1)]).flatten(1, 3)  # (2 N, channels, SECTORS)
        numbers = torch.cat([numbers, -numbers])
        seen, mirrored = self.head(torch.cat([self.eye(images), numbers], dim=1)).chunk(2)
        return (seen - mirrored)[:, 0], (seen + mirrored)[:, 1]

    def distribution(self, mean):
        return torch.distributions.Normal(mean, self.log_deviation.exp())


class Training:
    """PPO: a batch of steps, then a few passes over it that keep the policy close to what it was."""

    def __init__(self, hall, updates, threads, seed):
        self.env, self.updates = hall.environment(AGENTS, threads), updates
        torch.manual_seed(seed)
        self.policy, self.memory = Policy(), Memory(AGENTS)
        self.optimiser = torch.optim.Adam(self.policy.parameters(), lr=RATE, eps=1e-5)
        self.rates = torch.optim.lr_scheduler.LinearLR(self.optimiser, 1, 0.05, updates)
        _, infos = self.env.reset(seed=seed)
        self.memory.forget(np.full(AGENTS, True), infos["pose"])
        self.progress = np.zeros(AGENTS)  # of the current episodes, m

    @torch.no_grad()
    def collect(self):
        """A batch: images, numbers, steering, its log probability, advantage and return, each (STEPS * AGENTS, ...); and the
        progress of the episodes that ended, m."""
        rows, values, rewards, ends, ended = [], [], [], [], []
        for _ in range(STEPS):
            images, numbers = self.memory.tensors()
            mean, value = self.policy(images, numbers)
            distribution = self.policy.distribution(mean)
            steer = distribution.sample()
            counts, reward, terminated, truncated, infos = self.env.step(twists(steer.numpy()))
            over = terminated | truncated
            self.progress += reward
            self.note_ends(over, ended)
            # What follows an episode: nothing after a collision; after its time is over, what was expected.
            last, pose = counts.copy(), infos["pose"]
            if over.any():
                last[over], pose = np.stack(list(infos["final_obs"][over])), infos["final_info"]["pose"]
            self.memory.see(last, steer.numpy(), pose)
            after = self.policy(*self.memory.tensors())[1] * torch.from_numpy(~terminated)
            self.memory.forget(over, infos["pose"])
            rows.append((images, numbers, steer, distribution.log_prob(steer)))
            values.append(value)
            rewards.append(torch.from_numpy(reward).float() + DISCOUNT * after)
            ends.append(torch.from_numpy(over))
        values = torch.stack(values)
        errors = torch.stack(rewards) - values  # of the prediction, one step later
        advantages, advantage = torch.empty_like(values), torch.zeros(AGENTS)
        for t in reversed(range(STEPS)):
            advantage = errors[t] + DISCOUNT * GAE_LAMBDA * advantage * ~ends[t]
            advantages[t] = advantage
        columns = [*(torch.stack(column) for column in zip(*rows)), advantages, advantages + values]
        return [column.flatten(0, 1) for column in columns], ended

    def note_ends(self, over, ended):
        ended.extend(self.progress[over])
        self.progress[over] = 0

    def improve(self, batch):
        for _ in range(EPOCHS):
            for chosen in torch.randperm(len(batch[0])).split(MINIBATCH):
                images, numbers, steer, log_before, advantage, target = (column[chosen] for column in batch)
                mean, value = self.policy(images, numbers)
                ratio = (self.policy.distribution(mean).log_prob(steer) - log_before).exp()
                advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
                gain = torch.minimum(ratio * advantage, ratio.clamp(1 - CLIP, 1 + CLIP) * advantage).mean()
                loss = 0.5 * (value - target).square().mean() - gain
                self.optimiser.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(self.policy.parameters(), 0.5)
                self.optimiser.step()
        self.rates.step()

    def run(self, log):
        """Trains the policy, and writes the mean progress of recent episodes into a CSV file."""
        begin, recent = time.monotonic(), []
        with open(log, "w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["steps", "seconds", "progress_m", "deviation"])
            for update in range(1, self.updates + 1):
                batch, ended = self.collect()
                self.improve(batch)
                recent = (recent + ended)[-200:]
                seconds, steps = time.monotonic() - begin, update * AGENTS * STEPS
                mean, deviation = np.mean(recent) if recent else np.nan, self.policy.log_deviation.exp().item()
                writer.writerow([steps, f"{seconds:.1f}", f"{mean:.2f}", f"{deviation:.3f}"])
                if update % 5 == 0 or update == self.updates:
                    left = seconds / update * (self.updates - update)
                    last = f"last {len(recent)} episodes: {mean:5.1f} m, steering +-{deviation:.2f}"
                    print(f"{steps:7} steps, {last}; {left:.0f} s left", flush=True)
        self.env.close()
        return seconds


@torch.no_grad()
def fly(hall, steer_of, threads):
    """The progress (STARTS,), m, of the first episodes of agents; and whether they ended with a collision."""
    env, memory = hall.environment(STARTS, threads), Memory(STARTS)
    _, infos = env.reset(seed=1_000_000)
    memory.forget(np.full(STARTS, True), infos["pose"])
    progress, over, collided = np.zeros(STARTS), np.zeros(STARTS, bool), np.zeros(STARTS, bool)
    while not over.all():
        steer = steer_of(memory)
        counts, reward, terminated, truncated, infos = env.step(twists(steer))
        memory.see(counts, steer, infos["pose"])
        memory.forget(terminated | truncated, infos["pose"])
        progress += np.where(over, 0, reward)
        collided |= terminated & ~over
        over |= terminated | truncated
    env.close()
    return progress, collided


def evaluate(policy, halls, threads):
    """Compares the policy with others, from the same starts. Prints and returns a table."""
    random = np.random.default_rng(0)

    def blind(memory):
        images, numbers = memory.tensors()
        return policy(torch.zeros_like(images), numbers)[0].numpy()

    policies = {
        "trained": lambda memory: policy(*memory.tensors())[0].numpy(),
        "trained, blind": blind,  # gets no events
        "straight on": lambda memory: np.zeros(STARTS),
        "random": lambda memory: random.uniform(-1, 1, STARTS),
    }
    table = []
    print(f"progress in {EPISODE_S:g} s, of at most {SPEED * EPISODE_S:g} m, from {STARTS} starts in each of {len(halls)} halls")
    for name, steer_of in policies.items():
        results = [fly(hall, steer_of, threads) for hall in halls]
        progress, collided = (np.concatenate(part) for part in zip(*results))
        again = np.random.default_rng(0).choice(progress, (10_000, len(progress))).mean(axis=1)  # bootstrap
        low, high = np.percentile(again, [2.5, 97.5])
        mean, safe = progress.mean(), 1 - collided.mean()
        names = ("policy", "episodes", "progress_m", "low_m", "high_m", "without_collision")
        table.append(dict(zip(names, (name, len(progress), mean, low, high, safe))))
        print(f"{name:14} {mean:5.1f} m (95 %: {low:.1f} to {high:.1f}), {100 * safe:.0f} % without collision", flush=True)
    return table


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, help="folder of the results")
    parser.add_argument("--evaluate", action="store_true", help="only evaluate the policy in the folder")
    parser.add_argument("--force", action="store_true", help="replace results in the folder")
    parser.add_argument("--updates", type=int, default=70, help=f"of the policy, each after {AGENTS * STEPS} steps (default: 70)")
    parser.add_argument("--threads", type=int, default=1, help="of the simulation; 0: every processor (default: 1)")
    parser.add_argument("--seed", type=int, default=1, help="of the training (default: 1)")
    args = parser.parse_args()
    torch.set_num_threads(1)
    out = pathlib.Path(args.out)
    saved, result = out / "policy.pt", out / "result.json"
    if args.evaluate and not saved.exists():
        sys.exit(f"{saved}: not found; train without --evaluate first")
    if not args.evaluate and not args.force and (saved.exists() or result.exists()):
        sys.exit(f"{out}: contains results; use --force to replace them, or --evaluate to evaluate the policy")
    out.mkdir(parents=True, exist_ok=True)

    if not args.evaluate:
        training = Training(Hall(out, TRAINING_HALL), args.updates, args.threads, args.seed)
        seconds = training.run(out / "log.csv")
        torch.save(training.policy.state_dict(), saved)
        print(f"trained in {seconds:.0f} s")
    policy = Policy()
    policy.load_state_dict(torch.load(saved))
    table = evaluate(policy, [Hall(out, seed) for seed in OTHER_HALLS], args.threads)
    if args.evaluate and result.exists() and not args.force:
        print(f"{result}: not changed; use --force to replace it")
    else:
        result.write_text(json.dumps(table, indent=2) + "\n")


if __name__ == "__main__":
    main()
