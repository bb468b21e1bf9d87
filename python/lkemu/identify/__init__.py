"""Estimates the parameters of a motor from its logs: `python3 -m lkemu.identify`, the command `lk-emu identify`."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads only slow down small matrices
