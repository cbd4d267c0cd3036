"""The paper's seven convolutions there and back in PyTorch, beside `train_convolutions_64` of `cargo bench`.

Needs: pip install torch
"""

import json
import time

import torch

STEPS, BATCH = 30, 32
CHANNELS = [(3, 16, 2), (16, 24, 1), (24, 32, 2), (32, 48, 2), (48, 64, 2), (64, 64, 1)]

torch.set_num_threads(1)
layers = []
for inputs, outputs, stride in CHANNELS:
    layers += [torch.nn.Conv2d(inputs, outputs, 3, stride, 1), torch.nn.ReLU()]
network = torch.nn.Sequential(*layers, torch.nn.Conv2d(64, 128, 4), torch.nn.ReLU())
pictures = torch.rand(BATCH, 3, 64, 64)


def step():
    network.zero_grad()
    network(pictures).pow(2).sum().backward()


step()
begin = time.process_time()
for _ in range(STEPS):
    step()
print(json.dumps({"peer": f"PyTorch {torch.__version__}", "value": STEPS * BATCH / (time.process_time() - begin)}))
