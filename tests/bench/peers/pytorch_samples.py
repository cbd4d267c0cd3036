"""`ntp_paper` in PyTorch, layer by layer, beside `train_samples_paper` of `cargo bench`.

A step has the mini-batches that training Block Stacking has: 32 decisions of the root program on whole demonstrations,
in two parts by length, and 16 of each program below it. Inputs are random and made before the clock starts, so
drawing and augmenting examples, which ours includes, costs nothing here. Adam, gradients clipped, one thread.
Needs: pip install torch
"""

import json
import time

import torch
from torch import nn
from torch.nn.functional import binary_cross_entropy_with_logits, cross_entropy

SLOTS, FEATURES, WIDTH, PROGRAM, PROGRAMS, STEPS = 8, 50, 96, 32, 12, 100
# Decisions, frames of their windows, and what is learned besides program and end.
PARTS = [(16, 23, "scope"), (16, 15, "scope"), (16, 5, "scope"), (16, 3, "argument"), (16, 3, "argument")]


def mlp(*widths: int) -> nn.Sequential:
    pairs = zip(widths, widths[1:])
    return nn.Sequential(*(layer for a, b in pairs for layer in (nn.Linear(a, b), nn.ReLU())))


class Specification(nn.Module):
    def __init__(self, kernel: int):
        super().__init__()
        self.frame = mlp(FEATURES, WIDTH, WIDTH)
        self.conv = nn.Conv1d(WIDTH, WIDTH, kernel, padding=kernel // 2)
        self.summary = mlp(3 * WIDTH, WIDTH)

    def forward(self, frames: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        embedded = self.frame(frames)
        convolved = torch.relu(self.conv(embedded.transpose(1, 2))).transpose(1, 2)
        summary = torch.cat([convolved.amax(1), embedded[:, -1], embedded[:, 0]], 1)
        return convolved, self.summary(summary)


class NtpPaper(nn.Module):
    def __init__(self):
        super().__init__()
        self.state = mlp(FEATURES, WIDTH, WIDTH)
        self.specification = Specification(5)
        self.scope_frame = nn.Linear(WIDTH, WIDTH, bias=False)
        self.scope_context = nn.Linear(PROGRAM + WIDTH, WIDTH)
        self.scope_labels = nn.Linear(WIDTH, 4)
        self.core = mlp(WIDTH + PROGRAM + WIDTH, WIDTH, WIDTH)
        self.key_and_end = nn.Linear(WIDTH, PROGRAM + 1)
        self.programs = nn.Parameter(torch.rand(PROGRAMS, PROGRAM) - 0.5)
        self.keys = nn.Parameter(torch.rand(PROGRAMS, PROGRAM) - 0.5)
        self.argument_specification = Specification(3)
        self.argument_hidden = mlp(WIDTH + PROGRAM + WIDTH, WIDTH)
        self.argument_slots = nn.Linear(WIDTH, SLOTS)

    def losses(self, part: dict) -> torch.Tensor:
        state = self.state(part["states"])
        convolved, summary = self.specification(part["frames"])
        program = self.programs[part["program"]].expand(len(state), PROGRAM)
        output = self.key_and_end(self.core(torch.cat([summary, program, state], 1)))
        total = cross_entropy(output[:, :PROGRAM] @ self.keys.T, part["programs"])
        total = total + binary_cross_entropy_with_logits(output[:, PROGRAM], part["ends"])
        if part["learns"] == "scope":
            context = self.scope_context(torch.cat([program, state], 1))
            labels = self.scope_labels(torch.relu(self.scope_frame(convolved) + context[:, None]))
            return total + cross_entropy(labels.flatten(0, 1), part["labels"])
        _, argument = self.argument_specification(part["frames"])
        slots = self.argument_slots(self.argument_hidden(torch.cat([argument, program, state], 1)))
        return total + cross_entropy(slots, part["slots"])


def part(number: int, n: int, n_frames: int, learns: str) -> dict:
    return {
        "program": number,
        "learns": learns,
        "frames": torch.rand(n, n_frames, FEATURES),
        "states": torch.rand(n, FEATURES),
        "programs": torch.randint(PROGRAMS, (n,)),
        "ends": torch.randint(2, (n,)).float(),
        "labels": torch.randint(4, (n * n_frames,)),
        "slots": torch.randint(SLOTS, (n,)),
    }


torch.set_num_threads(1)
network = NtpPaper()
optimizer = torch.optim.Adam(network.parameters(), lr=0.002)
parts = [part(number, *shape) for number, shape in enumerate(PARTS)]


def step():
    optimizer.zero_grad()
    sum(network.losses(part) for part in parts).backward()
    nn.utils.clip_grad_norm_(network.parameters(), 5.0)
    optimizer.step()


for _ in range(5):
    step()
begin = time.process_time()
for _ in range(STEPS):
    step()
secs = time.process_time() - begin
n_parameters = sum(parameter.numel() for parameter in network.parameters())
peer = f"PyTorch {torch.__version__}, the same network of {n_parameters} parameters"
print(json.dumps({"peer": peer, "value": STEPS * sum(n for n, _, _ in PARTS) / secs}))
