"""Finds a motor's numbers in logs of it: `python3 -m lkemu.identify`, which is `lk-emu identify`."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small, and threads only wait for each other
